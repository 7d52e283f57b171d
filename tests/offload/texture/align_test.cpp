// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/align.h"
#include "offload/texture/bake.h"
#include "tests/offload/texture/scene.h"

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace gyre {
namespace {

const Progress silent = [](double, std::string_view) {};

TEST(Shift, IsInterpolatedBetweenTheNodes) {
  Photo photo;
  photo.image = cv::Mat(40, 40, CV_8UC3, cv::Scalar::all(0));
  EXPECT_EQ(shifted(photo, {7.0, 9.0}), Eigen::Vector2d(7.0, 9.0));
  photo.shift_grid = 10;
  photo.shift = cv::Mat(6, 6, CV_32FC2);
  for (int j = 0; j < 6; ++j) {
    for (int i = 0; i < 6; ++i) {
      photo.shift.at<cv::Vec2f>(j, i) = {0.1F * static_cast<float>(i), 0.2F * static_cast<float>(j)};
    }
  }
  const Eigen::Vector2d p = shifted(photo, {15.5, 30.5});
  EXPECT_NEAR(p.x(), 15.5 + 0.15, 1e-6);
  EXPECT_NEAR(p.y(), 30.5 + 0.6, 1e-6);
}

// A chequered ball that stood 10 mm (three pixels) aside in every other photograph.
class SwayingBall : public testing::Test {
 protected:
  SwayingBall() {
    scene::add_ball(ball_.mesh, 0.25, 16);
    checked_ = scene::painting(ball_.mesh, 1024);
    for (int y = 0; y < 1024; ++y) {
      for (int x = 0; x < 1024; ++x) checked_.at<cv::Vec3b>(y, x) *= (x / 16 + y / 16) % 2 == 0 ? 1.0 : 0.6;
    }
    photos_ = scene::ring(ball_.mesh, checked_, 12, 1.6);
    for (std::size_t p = 0; p < photos_.size(); ++p) {
      photos_[p].cam_from_world.translation += Eigen::Vector3d(p % 2 == 0 ? 0.005 : -0.005, 0, 0);
    }
  }

  // Mean difference from the true painting.
  double error(const BakedTexture& baked) const {
    cv::Mat truth;
    cv::resize(checked_, truth, baked.albedo.size(), 0, 0, cv::INTER_AREA);
    cv::Mat off;
    cv::absdiff(truth, baked.albedo, off);
    cv::Mat photographed = baked.view > 0;
    const cv::Scalar mean = cv::mean(off, photographed);
    return (mean[0] + mean[1] + mean[2]) / 3.0;
  }

  BakeSubject ball_;
  cv::Mat checked_;
  std::vector<Photo> photos_;
};

TEST_F(SwayingBall, IsBroughtTogether) {
  BakeOptions options;
  options.size = 512;
  options.place = false;
  options.align = false;
  const auto apart = bake_texture(ball_, photos_, options, 2, silent);
  options.align = true;
  const auto together = bake_texture(ball_, photos_, options, 2, silent);
  ASSERT_TRUE(apart && together);
  EXPECT_LT(error(*together), 0.85 * error(*apart));
}

}  // namespace
}  // namespace gyre
