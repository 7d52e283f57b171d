// SPDX-License-Identifier: Apache-2.0
#include "device/analysis/relative_pose.h"
#include "device/analysis/window_adjustment.h"

#include <gtest/gtest.h>
#include <random>

namespace gyre {
namespace {

constexpr double degree = M_PI / 180.0;

struct Scene {
  Camera camera = Camera::from_fov(180, 320, 58 * degree);
  std::vector<Eigen::Vector3d> points;  // before the camera a

  explicit Scene(int count) {
    std::mt19937 random(7);
    const auto uniform = [&](double from, double to) {
      return from + (to - from) * static_cast<double>(random()) / static_cast<double>(std::mt19937::max());
    };
    for (int i = 0; i < count; ++i) {
      const double depth = i % 3 == 0 ? uniform(1.8, 2.2) : uniform(3.5, 6.0);
      points.emplace_back(uniform(-0.22, 0.22) * depth, uniform(-0.45, 0.45) * depth, depth);
    }
  }

  // What both cameras see.
  void view(const Pose& b_from_a, std::vector<Eigen::Vector2d>& a, std::vector<Eigen::Vector2d>& b) const {
    for (const Eigen::Vector3d& point : points) {
      const auto in_b = camera.project(b_from_a * point);
      if (!in_b) continue;
      a.push_back(*camera.project(point));
      b.push_back(*in_b);
    }
  }
};

// A step of 8 degrees around a subject 2 m away.
Pose step() {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(8 * degree, Eigen::Vector3d(0.05, 1, 0).normalized()));
  return {turn, Eigen::Vector3d(0, 0.02, 2) - turn * Eigen::Vector3d(0, 0, 2)};
}

TEST(RelativePose, ExactMatchesGiveTheExactPose) {
  std::vector<Eigen::Vector2d> a, b;
  Scene(120).view(step(), a, b);
  const auto pose = relative_pose(a, b, Scene(1).camera);
  ASSERT_TRUE(pose);
  EXPECT_LT(angle_between(pose->b_from_a.rotation, step().rotation), 1e-4);
  EXPECT_LT((pose->b_from_a.translation - step().translation.normalized()).norm(), 1e-3);
  ASSERT_TRUE(pose->has_parallax());
  const Scene scene(120);
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_NEAR(pose->depth[i] * step().translation.norm(), scene.points[i].z(), 0.02 * scene.points[i].z());
  }
}

TEST(RelativePose, PointsThatSlideAreLeftOut) {
  std::vector<Eigen::Vector2d> a, b;
  Scene(120).view(step(), a, b);
  // A fifth of the points, all to one side, as on the subject's outline.
  for (std::size_t i = 0; i < b.size(); i += 5) b[i] += Eigen::Vector2d(1.0, 2.5);
  const auto pose = relative_pose(a, b, Scene(1).camera);
  ASSERT_TRUE(pose);
  EXPECT_LT(angle_between(pose->b_from_a.rotation, step().rotation), 0.1 * degree);
}

TEST(RelativePose, ATurnOnTheSpotHasNoParallax) {
  const Pose turn{Eigen::Quaterniond(Eigen::AngleAxisd(5 * degree, Eigen::Vector3d::UnitX())), Eigen::Vector3d::Zero()};
  std::vector<Eigen::Vector2d> a, b;
  Scene(80).view(turn, a, b);
  const auto pose = relative_pose(a, b, Scene(1).camera);
  ASSERT_TRUE(pose);
  EXPECT_FALSE(pose->has_parallax());
  EXPECT_LT(angle_between(pose->b_from_a.rotation, turn.rotation), 1e-6);
}

TEST(RelativePose, MatchesOfNothingGiveNothing) {
  std::mt19937 random(3);
  std::vector<Eigen::Vector2d> a, b;
  for (int i = 0; i < 60; ++i) {
    a.emplace_back(random() % 180, random() % 320);
    b.emplace_back(random() % 180, random() % 320);
  }
  EXPECT_FALSE(relative_pose(a, b, Scene(1).camera));
  a.resize(5);
  b.resize(5);
  EXPECT_FALSE(relative_pose(a, b, Scene(1).camera));
}

}  // namespace
}  // namespace gyre
