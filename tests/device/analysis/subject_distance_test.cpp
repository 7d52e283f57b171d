// SPDX-License-Identifier: Apache-2.0
#include "device/analysis/subject_distance.h"

#include "tests/device/analysis/staged_views.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

using test::StagedViews;

// The subject's depth is measured, and what stands behind is not counted.
SubjectDistance measured(double depth) {
  std::vector<double> depths(20, depth);
  depths.insert(depths.end(), 15, 3.0 * depth);
  SubjectDistance distance;
  distance.measure_nearest(depths);
  distance.measure_depth(depths, depth);
  return distance;
}

TEST(SubjectDistance, IsThatOfWhatTheCameraGoesAround) {
  const SubjectDistance distance = measured(2.0);
  EXPECT_EQ(distance.depth(), 2.0);
  EXPECT_EQ(distance.nearest(), 2.0);
  EXPECT_TRUE(distance.is_near(2.5));
  EXPECT_FALSE(distance.is_near(6.0));
}

TEST(SubjectDistance, FollowsAStepTowardsTheSubject) {
  const StagedViews stage;
  const ViewMap map = stage.map();
  SubjectDistance distance = measured(StagedViews::depth);
  Pose before = StagedViews::around(0.1);
  double z = 0.0;
  for (int i = 0; i < 10; ++i) {
    z += 0.05;
    const Pose now = Pose{Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, -z)} * StagedViews::around(0.1);
    distance.follow(map, stage.camera, before, stage.see(now));
    before = now;
  }
  // The person's points lie about the axis, so that the one in the middle keeps its depth in the turned view.
  EXPECT_NEAR(distance.log_distance(), std::log((StagedViews::depth - z) / StagedViews::depth), 0.005);
  EXPECT_NEAR(distance.depth(), StagedViews::depth - z, 0.01);
}

TEST(SubjectDistance, DoesNotJumpAtOneView) {
  SubjectDistance distance = measured(2.0);
  distance.measure_depth(std::vector<double>(20, 2.5), std::nullopt);
  EXPECT_NEAR(distance.depth(), 2.2, 1e-12);
}

TEST(SubjectShare, IsOfThePointsThatStandAtTheRadius) {
  std::vector<double> depths(10, 2.0);
  EXPECT_EQ(subject_share(depths, 2.0), 1.0);
  depths.insert(depths.end(), 30, 5.0);
  EXPECT_EQ(subject_share(depths, 2.0), 0.25);
  EXPECT_EQ(subject_share(std::vector<double>(10, 5.0), 2.0), 0.0) << "the room behind";
  EXPECT_EQ(subject_share({}, 2.0), 0.0) << "too far for a place";
  EXPECT_EQ(subject_share(depths, std::nullopt), std::nullopt);
}

TEST(IsInTheMiddle, OfAnUprightEllipse) {
  const Camera camera = Camera::from_fov(180, 320, 58.0 * M_PI / 180.0);
  const auto at = [&](double x, double y) { return is_in_the_middle(camera, camera.normalised_from_pixel({x, y})); };
  EXPECT_TRUE(at(90, 160));
  EXPECT_TRUE(at(90, 30));
  EXPECT_TRUE(at(140, 160));
  EXPECT_FALSE(at(150, 160));
  EXPECT_FALSE(at(90, 20));
  EXPECT_FALSE(at(130, 40));
}

}  // namespace
}  // namespace gyre
