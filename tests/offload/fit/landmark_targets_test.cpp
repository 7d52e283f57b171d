// SPDX-License-Identifier: Apache-2.0
// What the fit makes of placed landmarks.
#include "offload/fit/landmark_targets.h"

#include <gtest/gtest.h>
#include <Eigen/LU>

namespace gyre {
namespace {

PlacedLandmark placed(const std::string& name, double deviation) {
  return {name, {0, 1, 0}, deviation * deviation * Eigen::Matrix3d::Identity(), "picked", {}};
}

TEST(LandmarkTargets, TakesWhatTheTemplateHas) {
  BodyTemplate body;
  body.landmarks = {{"noseTip", 3}, {"leftHeel", 7}};
  LandmarkSet set;
  set.placed = {placed("leftHeel", 0.01), placed("thirdEye", 0.01), placed("noseTip", 0.002)};
  const auto targets = landmark_targets(body, set);
  ASSERT_EQ(targets.size(), 2U);
  EXPECT_EQ(targets[0].vertex, 7);
  EXPECT_EQ(targets[1].vertex, 3);
  EXPECT_GT(targets[1].trust, targets[0].trust);
  EXPECT_TRUE(landmark_targets(body, {}).empty());
  EXPECT_TRUE(landmark_targets({}, set).empty());
}

TEST(LandmarkTargets, TheCrownHoldsTheHeadSidewaysOnly) {
  BodyTemplate body;
  body.landmarks = {{"crown", 0}};
  LandmarkSet set;
  set.placed = {placed("crown", 0.003)};
  const Eigen::Matrix3d covariance = landmark_targets(body, set).at(0).information.inverse();
  EXPECT_GT(covariance(1, 1), 2 * covariance(0, 0));
  EXPECT_NEAR(covariance(0, 0), covariance(2, 2), 1e-12);
}

TEST(LandmarkTargets, KnowWhichMoveWithTheHead) {
  for (const char* name : {"noseTip", "leftEyeInner", "rightEar", "chin", "leftJawAngle", "rightEarLobe"})
    EXPECT_TRUE(on_head(name)) << name;
  for (const char* name : {"crown", "leftHeel", "navel", "rightElbow", "leftThumbTip"})
    EXPECT_FALSE(on_head(name)) << name;
}

}  // namespace
}  // namespace gyre
