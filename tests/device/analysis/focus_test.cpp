// SPDX-License-Identifier: Apache-2.0
#include "device/analysis/focus.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

TEST(FocusWatch, TellsDefocusFromHaste) {
  FocusWatch watch;
  double time = 0.0;
  for (; time < 2.0; time += 0.05) {
    const FocusReading reading = watch.add(time, 900.0, 0.4);
    EXPECT_TRUE(reading.is_sharp);
    EXPECT_FALSE(reading.is_hunting);
  }
  for (; time < 2.7; time += 0.05) {
    const FocusReading reading = watch.add(time, 60.0, 0.4);
    EXPECT_FALSE(reading.is_sharp);
    EXPECT_TRUE(reading.is_hunting);
  }
  EXPECT_TRUE(watch.add(time, 900.0, 0.4).is_sharp);
  const FocusReading hasty = watch.add(time + 0.05, 60.0, 2.0);
  EXPECT_FALSE(hasty.is_sharp);
  EXPECT_FALSE(hasty.is_hunting);
}

TEST(FocusWatch, GetsUsedToAPictureWithLessDetail) {
  FocusWatch watch;
  double time = 0.0;
  for (; time < 2.0; time += 0.1) watch.add(time, 900.0, 0.4);
  double sharpness = 900.0;
  for (; time < 6.0; time += 0.1) {
    sharpness = std::max(150.0, sharpness * 0.96);
    EXPECT_TRUE(watch.add(time, sharpness, 0.4).is_sharp) << time;
  }
}

}  // namespace
}  // namespace gyre
