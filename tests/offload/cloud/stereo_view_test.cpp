// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/stereo_view.h"

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

namespace gyre {
namespace {

TEST(QuadImage, HoldsTheBlockOfFourWithTheBorderRepeated) {
  cv::Mat grey = (cv::Mat_<std::uint8_t>(2, 2) << 1, 2, 3, 4);
  const QuadImage quads = make_quad_image(grey);
  EXPECT_EQ(quads.texels[0], 0x04030201U);
  EXPECT_EQ(quads.texels[1], 0x04040202U);
  EXPECT_EQ(quads.texels[3], 0x04040404U);
  EXPECT_FLOAT_EQ(quads.value(0, 1), 3.0F);
}

// A picture whose red is linear in the undistorted x and whose green is linear in y shows where each pixel came from.
TEST(StereoView, UndistortsAndScales) {
  Camera camera;
  camera.width = 240;
  camera.height = 320;
  camera.fx = camera.fy = 300;
  camera.cx = 118;
  camera.cy = 163;
  camera.k1 = -0.12;
  camera.k2 = 0.03;
  camera.p1 = 0.002;
  cv::Mat picture(camera.height, camera.width, CV_8UC3);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector2d xy = camera.normalised_from_pixel({x + 0.5, y + 0.5});
      picture.at<cv::Vec3b>(y, x) = cv::Vec3b(0, cv::saturate_cast<std::uint8_t>(128 + 200 * xy.y()),
                                              cv::saturate_cast<std::uint8_t>(128 + 200 * xy.x()));
    }
  }
  const StereoView view = make_stereo_view("a", picture, camera, Pose(), 160, 3);
  ASSERT_EQ(view.levels.size(), 3U);
  EXPECT_EQ(view.width(), 120);
  EXPECT_EQ(view.height(), 160);
  EXPECT_FALSE(view.camera.has_distortion());
  for (std::size_t level = 0; level < view.levels.size(); ++level) {
    const ImageLevel& l = view.levels[level];
    const Eigen::Matrix3d inverse = l.index_from_camera.inverse();
    for (int y = 10 >> level; y < l.image.height - (10 >> level); y += 7) {
      for (int x = 10 >> level; x < l.image.width - (10 >> level); x += 7) {
        const Eigen::Vector3d ray = inverse * Eigen::Vector3d(x, y, 1);
        const Rgb& colour = l.colours[static_cast<std::size_t>(y) * l.image.width + x];
        EXPECT_NEAR(colour[0], 128 + 200 * ray.x(), 1.6);
        EXPECT_NEAR(colour[1], 128 + 200 * ray.y(), 1.6);
        EXPECT_EQ(l.image.value(x, y), std::max(colour[0], colour[1]));
      }
    }
  }
}

TEST(StereoView, IsNeverEnlarged) {
  const cv::Mat picture(40, 30, CV_8UC3, cv::Scalar(1, 2, 3));
  const StereoView view = make_stereo_view("a", picture, Camera::from_fov(30, 40, 1.0), Pose(), 640, 1);
  EXPECT_EQ(view.width(), 30);
  EXPECT_EQ(view.levels[0].colours[5], Rgb(3, 2, 1));
}

}  // namespace
}  // namespace gyre
