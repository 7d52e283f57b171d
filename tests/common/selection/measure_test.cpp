// SPDX-License-Identifier: Apache-2.0
#include "common/selection/measure.h"

#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace gyre {
namespace {

// Smooth random texture; the shift may be a fraction of a pixel.
cv::Mat texture(double shift_x, double shift_y) {
  cv::Mat noise(360, 480, CV_8UC3);
  cv::RNG random(5);
  random.fill(noise, cv::RNG::UNIFORM, 0, 255);
  cv::GaussianBlur(noise, noise, {}, 3.0);
  cv::normalize(noise, noise, 0, 255, cv::NORM_MINMAX);
  const cv::Mat shift = (cv::Mat_<double>(2, 3) << 1, 0, shift_x, 0, 1, shift_y);
  cv::Mat moved;
  cv::warpAffine(noise, moved, shift, noise.size(), cv::INTER_CUBIC, cv::BORDER_REFLECT);
  return moved(cv::Rect(80, 60, 320, 240)).clone();
}

TEST(Measure, MotionIsTheLengthOfTheShift) {
  FrameMeter meter;
  EXPECT_EQ(meter.measure(texture(0, 0)).motion, 0.0) << "the first frame has none before it";
  EXPECT_NEAR(meter.measure(texture(3, 4)).motion, 5.0, 0.4);
  EXPECT_NEAR(meter.measure(texture(3, 4)).motion, 0.0, 1e-3);
}

TEST(Measure, MotionScalesWithTheAnalysisSize) {
  FrameMeter full({.flow_size = 320});
  FrameMeter half({.flow_size = 160});
  full.measure(texture(0, 0));
  half.measure(texture(0, 0));
  const double motion = full.measure(texture(4, 0)).motion;
  EXPECT_NEAR(half.measure(texture(4, 0)).motion, 0.5 * motion, 0.15 * motion);
}

TEST(Measure, BlurLowersSharpness) {
  const cv::Mat sharp = texture(0, 0);
  double before = FrameMeter().measure(sharp).sharpness;
  for (const double sigma : {1.0, 2.0, 4.0}) {
    cv::Mat blurred;
    cv::GaussianBlur(sharp, blurred, {}, sigma);
    const double after = FrameMeter().measure(blurred).sharpness;
    EXPECT_LT(after, before);
    before = after;
  }
}

TEST(Measure, LaplacianVarianceOfAStep) {
  // One dark column on white: the Laplacian is 2 * 255 there, -255 beside it.
  cv::Mat image(10, 30, CV_8UC1, cv::Scalar(255));
  image.col(15).setTo(0);
  const double square = (2.0 * 255 * 2.0 * 255 + 2.0 * 255 * 255) / 30.0;
  EXPECT_NEAR(laplacian_variance(image), square, 1e-6);
}

TEST(Measure, LumaIsNeverEnlarged) {
  const cv::Mat small(20, 30, CV_8UC3, cv::Scalar::all(7));
  EXPECT_EQ(reduced_luma(small, 320).size(), small.size());
  EXPECT_EQ(reduced_luma(small, 15).size(), cv::Size(15, 10));
}

}  // namespace
}  // namespace gyre
