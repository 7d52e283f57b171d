// SPDX-License-Identifier: Apache-2.0
#include "device/camera/sensor_clock.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

TEST(SensorClock, RecognisesTheMachinesClocks) {
  // The machine slept for an hour: its boot clock is ahead by that.
  SensorClock monotonic;
  EXPECT_FALSE(monotonic.offset());
  monotonic.add(100.00, 100.03, 3700.03);
  EXPECT_DOUBLE_EQ(monotonic.offset().value(), 0.0);
  SensorClock boot;
  boot.add(3700.00, 100.03, 3700.03);
  EXPECT_DOUBLE_EQ(boot.offset().value(), -3600.0);
}

TEST(SensorClock, OfAnUnknownClockTheQuickestFrameTells) {
  SensorClock clock;
  clock.add(7.00, 100.08, 3700.0);
  clock.add(7.10, 100.13, 3700.0);
  clock.add(7.20, 100.35, 3700.0);
  EXPECT_NEAR(clock.offset().value(), 93.03, 1e-9);
  clock.restart();
  EXPECT_FALSE(clock.offset());
}

}  // namespace
}  // namespace gyre
