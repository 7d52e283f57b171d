// SPDX-License-Identifier: Apache-2.0
#include "device/panel/shine.h"

#include <gtest/gtest.h>
#include <set>

namespace gyre {
namespace {

constexpr Colour colours[] = {Colour::off, Colour::white, Colour::green, Colour::blue, Colour::yellow, Colour::red};
constexpr Tone tones[] = {Tone::low, Tone::high, Tone::double_low, Tone::double_high, Tone::rising};

TEST(Shine, ColoursDifferAlsoOnLampsThatAreOnlyOnOrOff) {
  std::set<int> seen;
  for (const Colour colour : colours) {
    const Rgb rgb = rgb_of(colour);
    seen.insert((rgb.red >= 128) * 4 + (rgb.green >= 128) * 2 + (rgb.blue >= 128));
  }
  EXPECT_EQ(seen.size(), std::size(colours));
  EXPECT_EQ(dimmed({255, 100, 0}, 0.5), (Rgb{128, 50, 0}));
}

TEST(Shine, PatternsBeginBrightAndBlinkAtTheirRate) {
  const auto changes = [](Pattern pattern) {
    int count = 0;
    bool was = true;
    for (int i = 0; i < 4000; ++i) {
      const bool is = level_of(pattern, i / 1000.0) >= 0.5;
      count += is != was;
      was = is;
    }
    return count;
  };
  for (const Pattern pattern : {Pattern::steady, Pattern::slow_blink, Pattern::fast_blink, Pattern::pulse})
    EXPECT_EQ(level_of(pattern, 0.0), 1.0);
  EXPECT_EQ(changes(Pattern::steady), 0);
  EXPECT_EQ(changes(Pattern::pulse), 4);
  EXPECT_EQ(changes(Pattern::slow_blink), 7);
  EXPECT_EQ(changes(Pattern::fast_blink), 31);
}

TEST(Shine, TonesAreHeardOnceAndDiffer) {
  EXPECT_EQ(frequency_of(Tone::none, 0.0), 0.0);
  std::set<std::vector<double>> tunes;
  for (const Tone tone : tones) {
    EXPECT_GT(frequency_of(tone, 0.0), 0.0);
    std::vector<double> tune;
    for (int i = 0; i < 100; ++i) tune.push_back(frequency_of(tone, i / 100.0));
    EXPECT_EQ(tune.back(), 0.0);
    tunes.insert(tune);
  }
  EXPECT_EQ(tunes.size(), std::size(tones));
}

}  // namespace
}  // namespace gyre
