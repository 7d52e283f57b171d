// SPDX-License-Identifier: Apache-2.0
#include "device/camera/settle_watch.h"

#include <gtest/gtest.h>
#include <cmath>

namespace gyre {
namespace {

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

// A camera whose times begin anew in the middle is waited for once more, and no longer.
TEST(SettleWatch, IsLateAfterItsPatience) {
  SettleWatch watch;
  EXPECT_FALSE(watch.is_late());
  watch.begin(std::chrono::milliseconds(1000));
  const auto flicker_until = [&](double end) {
    bool is_late = false;
    for (int i = 0; 0.1 * i < end - 0.05; ++i) {
      watch.add(5.0 + 0.1 * i, i % 2 == 0 ? 100.0 : 110.0);
      is_late = is_late || watch.is_late();
    }
    return is_late;
  };
  EXPECT_FALSE(flicker_until(0.9));
  watch.restart();
  EXPECT_FALSE(watch.is_late());
  EXPECT_FALSE(flicker_until(0.9));
  EXPECT_TRUE(flicker_until(1.2));
}

}  // namespace
}  // namespace gyre
