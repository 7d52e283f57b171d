// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/turn_axis.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

constexpr double degree = 0.017453292519943295;
const Eigen::Vector3d true_direction = Eigen::Vector3d(0.2, 1, -0.3).normalized();
const Eigen::Vector3d true_point(1.5, -0.4, 3.0);

// A subject that turns by `angle` about the true axis before a camera that stands askew.
Pose pose_at(double angle) {
  // Half a turn about x points y down.
  const Pose camera{Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitZ()) *
                                       Eigen::AngleAxisd(3.3, Eigen::Vector3d::UnitX())),
                    {0.3, 0.5, 4.0}};
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(angle, true_direction));
  return camera * Pose{turn, true_point - turn * true_point};
}

double distance_from_axis(const Eigen::Vector3d& p) {
  return (p - true_point).cross(true_direction).norm();
}

TEST(TurnAxis, of_a_full_turn_and_of_a_part_is_exact) {
  for (const double arc : {360.0, 100.0, 30.0}) {
    std::vector<Pose> poses;
    for (int i = 0; i < 20; ++i) poses.push_back(pose_at(arc * degree * i / 20));
    const auto axis = turn_axis(poses);
    ASSERT_TRUE(axis) << arc;
    EXPECT_LT((axis->direction - true_direction).norm(), 1e-6) << arc;
    EXPECT_LT(distance_from_axis(axis->point), 1e-6) << arc;
  }
}

TEST(TurnAxis, bears_a_misplaced_view) {
  std::vector<Pose> poses;
  for (int i = 0; i < 24; ++i) poses.push_back(pose_at(15 * degree * i));
  poses[7] = Pose{Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitX())), {0.2, 0.1, 0.3}} * poses[7];
  const auto axis = turn_axis(poses);
  ASSERT_TRUE(axis);
  EXPECT_LT(std::acos(axis->direction.dot(true_direction)), 0.15 * degree);
  EXPECT_LT(distance_from_axis(axis->point), 0.01);
}

TEST(TurnAxis, needs_a_turn) {
  std::vector<Pose> poses;
  for (int i = 0; i < 10; ++i) poses.push_back(pose_at(degree * i));
  EXPECT_FALSE(turn_axis(poses));
  EXPECT_FALSE(turn_axis(std::span(poses).first(2)));
}

}  // namespace
}  // namespace gyre
