// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/consistency.h"

#include "ray_scene.h"

#include <gtest/gtest.h>
#include <algorithm>

namespace gyre {
namespace {

using test::RayScene;

class Consistency : public testing::Test {
 protected:
  Consistency() {
    for (const StereoView& view : views_) maps_.push_back(test::true_depth(scene_, view));
  }
  PointCloud points_of(int reference) const {
    std::vector<int> others;
    for (int j = 0; j < static_cast<int>(views_.size()); ++j) {
      if (j != reference) others.push_back(j);
    }
    return consistent_points(views_, maps_, reference, others, scene_.region(), {});
  }

  RayScene scene_;
  std::vector<StereoView> views_ = test::views_on_arc(scene_, 4, 9.0, 96);
  std::vector<StereoDepth> maps_;
};

TEST_F(Consistency, TrueDepthsGiveTheSurface) {
  const PointCloud cloud = points_of(1);
  const auto seen = std::count(maps_[1].state.begin(), maps_[1].state.end(), PixelState::surface);
  EXPECT_GT(static_cast<double>(cloud.points.size()), 0.6 * static_cast<double>(seen));
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const Eigen::Vector3d out = cloud.points[i].cast<double>() - scene_.centre;
    EXPECT_NEAR(out.norm(), scene_.radius, 0.004);
    EXPECT_GT(out.normalized().dot(cloud.normals[i].cast<double>()), 0.97);
    EXPECT_GT(cloud.confidence[i], 0.0F);
    EXPECT_LE(cloud.confidence[i], 1.0F);
  }
}

TEST_F(Consistency, DeviationIsWhatTheViewsDisagreeOnAndAShareOfAPixel) {
  const auto median_square_on = [&](const PointCloud& cloud) {
    const Eigen::Vector3f eye = centre_of(views_[1].cam_from_world).cast<float>();
    std::vector<float> values;
    for (std::size_t i = 0; i < cloud.points.size(); ++i) {
      if (cloud.normals[i].dot((eye - cloud.points[i]).normalized()) > 0.98F) values.push_back(cloud.deviation[i]);
    }
    std::sort(values.begin(), values.end());
    return values.empty() ? 0.0F : values[values.size() / 2];
  };
  const double pixel = 0.92 / 125;  // of the surface, square on: its distance over the focal length, metres
  EXPECT_NEAR(median_square_on(points_of(1)), 0.1 * pixel, 0.05 * pixel);
  // Four maps that differ by 6 mm each from the next have a sample deviation of 7.7 mm.
  for (int i = 0; i < 4; ++i) {
    for (float& depth : maps_[i].depth) depth += 0.006F * (static_cast<float>(i) - 1.5F);
  }
  ConfirmationOptions loose;
  loose.max_relative_depth = 0.05;
  loose.see_through = 0.05;
  loose.max_pixels = 5;
  loose.min_views = 4;
  loose.max_colour_difference = 255;
  const std::vector<int> others = {0, 2, 3};
  EXPECT_NEAR(median_square_on(consistent_points(views_, maps_, 1, others, scene_.region(), loose)), 0.0077, 0.001);
}

TEST_F(Consistency, AnOutlierViewIsRejectedAndDoesNotHarmTheOthers) {
  const std::size_t before = points_of(1).points.size();
  for (float& depth : maps_[3].depth) depth *= 0.9F;
  EXPECT_TRUE(points_of(3).points.empty());
  EXPECT_GT(points_of(1).points.size(), before * 8 / 10);
}

TEST_F(Consistency, AViewThatSeesThroughSpeaksAgainst) {
  // Two views claim a surface 5 % too near; two see what lies behind it.
  for (const int i : {0, 1}) {
    for (float& depth : maps_[i].depth) depth *= 0.95F;
  }
  EXPECT_TRUE(points_of(1).points.empty());
}

TEST_F(Consistency, AnotherColourDoesNotConfirm) {
  for (const int i : {0, 2, 3}) {
    for (Rgb& colour : views_[i].levels[0].colours) colour = Rgb(0, 255, 0);
  }
  EXPECT_TRUE(points_of(1).points.empty());
}

}  // namespace
}  // namespace gyre
