// SPDX-License-Identifier: Apache-2.0
#include "device/panel/press.h"

#include <gtest/gtest.h>
#include <map>
#include <random>

namespace gyre {
namespace {

TEST(Press, ItsLengthSaysWhatItMeans) {
  PressClassifier button;
  EXPECT_FALSE(button.edge(1.0, true));
  EXPECT_TRUE(button.is_down());
  EXPECT_EQ(button.edge(1.2, false), Press::short_press);
  EXPECT_FALSE(button.is_down());
  EXPECT_FALSE(button.edge(2.0, true));
  EXPECT_EQ(button.edge(3.0, false), Press::long_press);
  EXPECT_FALSE(button.edge(4.0, true));
  EXPECT_EQ(button.edge(9.0, false), Press::very_long_press);
}

TEST(Press, AVeryLongOneCountsWhileItIsHeldAndOnlyOnce) {
  PressClassifier button;
  EXPECT_FALSE(button.edge(1.0, true));
  EXPECT_FALSE(button.wait(2.0));
  EXPECT_FALSE(button.wait(4.9));
  EXPECT_EQ(button.wait(5.0), Press::very_long_press);
  EXPECT_FALSE(button.wait(6.0));
  EXPECT_FALSE(button.edge(7.0, false));
  EXPECT_FALSE(button.wait(8.0));
}

TEST(Press, EdgesThatRepeatSayNothing) {
  PressClassifier button;
  EXPECT_FALSE(button.edge(0.0, false));
  EXPECT_FALSE(button.edge(1.0, true));
  EXPECT_FALSE(button.edge(1.5, true));
  EXPECT_EQ(button.edge(2.0, false), Press::long_press);
  EXPECT_FALSE(button.edge(2.1, false));
}

TEST(Press, EveryPressCountsOnceWhateverItsLength) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> length(0.02, 6.0);
  PressClassifier button;
  double time = 0.0;
  std::map<Press, int> expected, counted;
  for (int i = 0; i < 1000; ++i) {
    const double held = length(random);
    ++expected[held < 0.8 ? Press::short_press : held < 4.0 ? Press::long_press : Press::very_long_press];
    const double end = time + held;
    if (const auto press = button.edge(time, true)) ++counted[*press];
    for (; time < end; time += 0.05) {
      if (const auto press = button.wait(time)) ++counted[*press];
    }
    if (const auto press = button.edge(end, false)) ++counted[*press];
    time = end + length(random);
  }
  EXPECT_EQ(counted, expected);
}

}  // namespace
}  // namespace gyre
