// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/features.h"

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace gyre {
namespace {

TEST(RootSift, is_the_root_of_the_l1_normalised_vector_and_has_unit_norm) {
  std::array<float, 128> sift{};
  for (std::size_t i = 0; i < 128; ++i) sift[i] = static_cast<float>((i * 37) % 101);
  const double sum = std::accumulate(sift.begin(), sift.end(), 0.0);
  const Descriptor root = root_sift(sift.data());
  double norm2 = 0.0;
  for (std::size_t i = 0; i < 128; ++i) {
    EXPECT_NEAR(root[i], descriptor_norm * std::sqrt(sift[i] / sum), 0.5);
    norm2 += root[i] * root[i];
  }
  EXPECT_NEAR(std::sqrt(norm2), descriptor_norm, 0.01 * descriptor_norm);
}

TEST(RootSift, of_an_empty_patch_is_zero) {
  const std::array<float, 128> nothing{};
  EXPECT_EQ(root_sift(nothing.data()), Descriptor{});
}

// A Gaussian blob whose centre is known to a fraction of a pixel, in our convention of pixel centres at halves.
cv::Mat blob_picture(const Eigen::Vector2d& centre, double sigma) {
  cv::Mat picture(160, 200, CV_8UC3);
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      const double r2 = (Eigen::Vector2d(x + 0.5, y + 0.5) - centre).squaredNorm();
      const auto value = static_cast<unsigned char>(std::lround(30 + 200 * std::exp(-0.5 * r2 / (sigma * sigma))));
      picture.at<cv::Vec3b>(y, x) = {value, value, value};
    }
  }
  return picture;
}

TEST(Features, a_blob_is_found_where_it_is) {
  for (const Eigen::Vector2d& centre : {Eigen::Vector2d(100.5, 80.5), Eigen::Vector2d(61.3, 47.9)}) {
    const Features features = detect_features(blob_picture(centre, 4.0));
    ASSERT_FALSE(features.keypoints.empty());
    double nearest = 1e9;
    for (const Eigen::Vector2d& keypoint : features.keypoints) nearest = std::min(nearest, (keypoint - centre).norm());
    EXPECT_LT(nearest, 0.05);
  }
}

TEST(Features, no_place_occurs_twice_and_every_descriptor_has_one) {
  cv::Mat noise(200, 200, CV_8UC3);
  cv::RNG random(7);
  random.fill(noise, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(noise, noise, {}, 2.0);
  cv::normalize(noise, noise, 0, 255, cv::NORM_MINMAX);
  const Features features = detect_features(noise);
  ASSERT_GT(features.keypoints.size(), 50U);
  EXPECT_EQ(features.descriptors.size(), features.keypoint_of.size());
  EXPECT_GE(features.descriptors.size(), features.keypoints.size());
  std::set<std::pair<double, double>> places;
  for (const Eigen::Vector2d& k : features.keypoints) places.emplace(k.x(), k.y());
  EXPECT_EQ(places.size(), features.keypoints.size());
  EXPECT_TRUE(std::is_sorted(features.sizes.rbegin(), features.sizes.rend()));
}

TEST(Features, an_even_picture_has_none) {
  EXPECT_TRUE(detect_features(cv::Mat(100, 100, CV_8UC3, cv::Scalar(90, 90, 90))).keypoints.empty());
}

TEST(Features, a_missing_picture_is_an_error_that_names_it) {
  const auto picture = read_upright("no-such-folder/body-000001.jpg");
  ASSERT_FALSE(picture);
  EXPECT_NE(picture.error().message().find("body-000001.jpg"), std::string::npos);
}

}  // namespace
}  // namespace gyre
