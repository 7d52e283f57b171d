// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/view_effects.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

TEST(ViewEffects, RecoversAdditiveEffectsExactly) {
  const std::vector<double> truth = {0.3, -0.1, -0.4, 0.2};
  std::vector<Measurement> measurements;
  for (int item = 0; item < 40; ++item) {
    for (const int view : {item % 4, (item + 1) % 4}) {
      measurements.push_back({item, view, truth[view] + 0.7 * item});
    }
  }
  const std::vector<double> effects = view_effects(measurements, 4, 1.0, 1e-7);
  for (int v = 0; v < 4; ++v) EXPECT_NEAR(effects[v], truth[v], 1e-6);
}

TEST(ViewEffects, ShrugsOffOutliers) {
  std::vector<Measurement> measurements;
  for (int item = 0; item < 100; ++item) {
    for (int view = 0; view < 3; ++view) {
      const double wrong = item % 10 == 0 && view == 1 ? 3.0 : 0.0;
      measurements.push_back({item, view, 0.1 * view + wrong});
    }
  }
  const std::vector<double> effects = view_effects(measurements, 3, 0.02, 1e-9);
  EXPECT_NEAR(effects[1] - effects[0], 0.1, 0.01);
  EXPECT_NEAR(effects[2] - effects[0], 0.2, 0.01);
}

TEST(ViewEffects, LeavesALonelyViewAlone) {
  const std::vector<Measurement> measurements = {{0, 0, 1.0}, {0, 1, 1.5}, {1, 2, 9.0}};
  EXPECT_NEAR(view_effects(measurements, 3, 1.0, 0.01)[2], 0.0, 1e-12);
}

}  // namespace
}  // namespace gyre
