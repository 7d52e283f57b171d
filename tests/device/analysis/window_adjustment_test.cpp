// SPDX-License-Identifier: Apache-2.0
#include "device/analysis/window_adjustment.h"

#include <gtest/gtest.h>
#include <limits>
#include <random>

namespace gyre {
namespace {

constexpr double degree = M_PI / 180.0;

class Window : public testing::Test {
 protected:
  Window() {
    std::mt19937 random(5);
    const auto uniform = [&](double from, double to) {
      return from + (to - from) * static_cast<double>(random()) / static_cast<double>(std::mt19937::max());
    };
    for (int i = 0; i < 60; ++i) points_.emplace_back(uniform(-0.6, 0.6), uniform(-1, 1), uniform(1.7, 4.0));
    for (int v = 0; v < 5; ++v) {
      const Eigen::Quaterniond turn(Eigen::AngleAxisd(4 * v * degree, Eigen::Vector3d::UnitY()));
      WindowView& view = views_.emplace_back();
      view.cam_from_world = {turn, Eigen::Vector3d(0, 0, 2) - turn * Eigen::Vector3d(0, 0, 2)};
      for (int i = 0; i < 60; ++i) {
        const Eigen::Vector3d x = view.cam_from_world * points_[static_cast<std::size_t>(i)];
        view.sightings.push_back({i, x.hnormalized()});
      }
    }
  }
  std::vector<Eigen::Vector3d> points_;
  std::vector<WindowView> views_;
};

TEST_F(Window, FindsBackToTheTruth) {
  const std::vector<WindowView> true_views = views_;
  const std::vector<Eigen::Vector3d> true_points = points_;
  for (std::size_t v = 2; v < views_.size(); ++v) {
    views_[v].cam_from_world.rotation = rotation_about({0.01, -0.02, 0.01}) * views_[v].cam_from_world.rotation;
    views_[v].cam_from_world.translation += Eigen::Vector3d(0.02, -0.01, 0.03);
  }
  for (Eigen::Vector3d& point : points_) point *= 1.03;
  for (int i = 0; i < 5; ++i) adjust_window(views_, 2, points_);
  for (std::size_t v = 0; v < views_.size(); ++v) {
    EXPECT_LT(angle_between(views_[v].cam_from_world.rotation, true_views[v].cam_from_world.rotation), 1e-4);
    EXPECT_LT((views_[v].cam_from_world.translation - true_views[v].cam_from_world.translation).norm(), 1e-3);
  }
  for (std::size_t p = 0; p < points_.size(); ++p) EXPECT_LT((points_[p] - true_points[p]).norm(), 1e-2);
}

TEST_F(Window, ResectionIsRobust) {
  const Pose truth = views_[3].cam_from_world;
  std::vector<Sighting> sightings = views_[3].sightings;
  for (std::size_t i = 0; i < sightings.size(); i += 4) sightings[i].at += Eigen::Vector2d(0.03, 0.01);
  const Pose start{rotation_about({0.0, 0.03, 0.01}) * truth.rotation, truth.translation};
  const Pose pose = resected(start, sightings, points_);
  EXPECT_LT(angle_between(pose.rotation, truth.rotation), 0.1 * degree);
  EXPECT_LT((pose.translation - truth.translation).norm(), 5e-3);
}

TEST_F(Window, BehindTheCameraIsInfinitelyWrong) {
  EXPECT_EQ(reprojection_error({}, {0, 0, -1}, {0, 0}), std::numeric_limits<double>::infinity());
  EXPECT_EQ(reprojection_error({}, {0, 0, 1}, {0, 0}), 0.0);
}

}  // namespace
}  // namespace gyre
