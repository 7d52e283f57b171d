// SPDX-License-Identifier: Apache-2.0
#include "common/video/orient.h"

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

namespace gyre {
namespace {

// Every pixel of its own value, so that a wrong move shows.
cv::Mat numbered(int width, int height) {
  cv::Mat image(height, width, CV_8UC3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      image.at<cv::Vec3b>(y, x) = {static_cast<uchar>(x), static_cast<uchar>(y), static_cast<uchar>(x * 7 + y * 13)};
    }
  }
  return image;
}

TEST(Orient, MovesEveryPixelAsTheCameraModelSays) {
  constexpr int width = 7;
  constexpr int height = 5;
  const cv::Mat stored = numbered(width, height);
  for (int value = 1; value <= 8; ++value) {
    const auto orientation = static_cast<Orientation>(value);
    const cv::Mat upright = oriented(stored, orientation);
    ASSERT_EQ(upright.cols, value >= 5 ? height : width) << value;
    ASSERT_EQ(upright.rows, value >= 5 ? width : height) << value;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const Eigen::Vector2d to = oriented(Eigen::Vector2d(x + 0.5, y + 0.5), width, height, orientation);
        const cv::Vec3b moved = upright.at<cv::Vec3b>(static_cast<int>(to.y()), static_cast<int>(to.x()));
        ASSERT_EQ(moved, stored.at<cv::Vec3b>(y, x)) << "orientation " << value << " at " << x << ", " << y;
      }
    }
  }
}

TEST(Orient, RotationsAreAsExifNamesThem) {
  const cv::Mat stored = numbered(3, 2);
  // 6: the stored picture has to be turned clockwise, so its first row becomes the last column.
  const cv::Mat turned = oriented(stored, Orientation::rotated_90);
  EXPECT_EQ(turned.at<cv::Vec3b>(0, 1), stored.at<cv::Vec3b>(0, 0));
  EXPECT_EQ(turned.at<cv::Vec3b>(2, 1), stored.at<cv::Vec3b>(0, 2));
}

}  // namespace
}  // namespace gyre
