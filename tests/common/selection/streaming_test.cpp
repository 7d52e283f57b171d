// SPDX-License-Identifier: Apache-2.0
#include "common/selection/streaming.h"

#include <gtest/gtest.h>
#include <random>
#include <set>

namespace gyre {
namespace {

std::vector<FrameMeasure> recording(std::uint32_t seed, int frames) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise;
  std::vector<FrameMeasure> out;
  double speed = 2.0;
  for (int i = 0; i < frames; ++i) {
    speed = std::clamp(speed + 0.2 * noise(random), 0.5, 4.0);
    out.push_back({i == 0 ? 0.0 : speed, 500.0 * std::exp(0.1 * noise(random))});
  }
  return out;
}

StreamingOptions options_for(int expected_frames) {
  StreamingOptions options;
  options.expected_frames = expected_frames;
  return options;
}

TEST(Streaming, EndsWithTheExactSelection) {
  for (std::uint32_t seed = 0; seed < 10; ++seed) {
    const std::vector<FrameMeasure> frames = recording(seed, 300 + 70 * static_cast<int>(seed));
    StreamingSelector selector(options_for(300));
    for (const FrameMeasure& frame : frames) selector.push(frame);
    const Result<Selection> streamed = selector.finish();
    const Result<Selection> exact = select_keyframes(frames, {});
    ASSERT_TRUE(streamed);
    ASSERT_TRUE(exact);
    EXPECT_EQ(streamed->keyframes, exact->keyframes);
  }
}

TEST(Streaming, ProposesEachFrameOnceAndInTime) {
  StreamingSelector selector(options_for(300));
  std::set<int> proposed;
  int pushed = 0;
  for (const FrameMeasure& frame : recording(1, 300)) {
    const std::optional<int> candidate = selector.push(frame);
    if (candidate) {
      EXPECT_EQ(*candidate, pushed - selector.latency());
      EXPECT_TRUE(proposed.insert(*candidate).second);
    }
    ++pushed;
  }
  EXPECT_EQ(static_cast<int>(proposed.size()), selector.proposed());
}

TEST(Streaming, ProposalsAreBoundedHoweverLongItTakes) {
  const StreamingOptions options = options_for(300);
  StreamingSelector selector(options);
  for (const FrameMeasure& frame : recording(2, 3000)) selector.push(frame);
  EXPECT_LE(selector.proposed(), options.candidates * options.selection.keyframes);
}

TEST(Streaming, MostKeyframesAreProposedBeforeTheStop) {
  double share = 0.0;
  constexpr int rounds = 20;
  for (std::uint32_t seed = 0; seed < rounds; ++seed) {
    StreamingSelector selector(options_for(300));
    std::set<int> proposed;
    for (const FrameMeasure& frame : recording(seed, 300)) {
      if (const std::optional<int> candidate = selector.push(frame)) proposed.insert(*candidate);
    }
    const Result<Selection> selection = selector.finish();
    ASSERT_TRUE(selection);
    const auto early = std::count_if(selection->keyframes.begin(), selection->keyframes.end(),
                                     [&](int i) { return proposed.contains(i); });
    share += static_cast<double>(early) / static_cast<double>(selection->keyframes.size()) / rounds;
  }
  EXPECT_GT(share, 0.5);
}

TEST(Streaming, ProposesNothingWhenNothingMoves) {
  StreamingSelector selector(options_for(300));
  for (int i = 0; i < 300; ++i) EXPECT_FALSE(selector.push({0.001, 100.0}));
  EXPECT_FALSE(selector.finish());
}

TEST(Streaming, ChecksItsOptions) {
  EXPECT_TRUE(options_for(300).check());
  EXPECT_FALSE(options_for(0).check());
  StreamingOptions few = options_for(300);
  few.candidates = 0.5;
  EXPECT_FALSE(few.check());
}

}  // namespace
}  // namespace gyre
