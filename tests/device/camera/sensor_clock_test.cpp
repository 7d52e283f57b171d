// SPDX-License-Identifier: Apache-2.0
#include "device/camera/sensor_clock.h"

#include "device/camera/settle_watch.h"

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

TEST(SettleWatch, WaitsUntilTheBrightnessRests) {
  SettleWatch watch;
  double settled = 0.0;
  for (double time = 0.0; settled == 0.0 && time < 10.0; time += 0.1) {
    const double brightness = 120.0 - 80.0 * std::exp(-time / 0.5);  // as an automatic exposure comes in
    if (watch.add(time, brightness)) settled = time;
  }
  EXPECT_GT(settled, 1.5);
  EXPECT_LT(settled, 3.0);
  EXPECT_FALSE(watch.add(settled + 0.1, 60.0));
  watch.restart();
  EXPECT_FALSE(watch.add(20.0, 120.0));
  EXPECT_FALSE(watch.add(20.4, 120.0));
  EXPECT_TRUE(watch.add(20.6, 121.0));
}

TEST(SettleWatch, FlickerDoesNotSettle) {
  SettleWatch watch;
  for (int i = 0; i < 100; ++i) EXPECT_FALSE(watch.add(0.05 * i, i % 2 == 0 ? 100.0 : 104.0));
}

}  // namespace
}  // namespace gyre
