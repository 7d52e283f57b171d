// SPDX-License-Identifier: Apache-2.0
#include "common/selection/farneback.h"
#include "common/selection/measure.h"

#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

namespace gyre {
namespace {

// A textured figure before a textured wall, both flat; the figure and the wall are shifted by their own ways.
cv::Mat scene(const cv::Size& size, const cv::Point2d& wall, const cv::Point2d& figure) {
  cv::Mat noise(size * 2, CV_8U);
  cv::RNG random(5);
  random.fill(noise, cv::RNG::UNIFORM, 0, 255);
  cv::GaussianBlur(noise, noise, {}, 2.5);
  cv::normalize(noise, noise, 0, 255, cv::NORM_MINMAX);
  const auto shifted = [&](const cv::Point2d& by, const cv::Point& from) {
    const cv::Mat shift = (cv::Mat_<double>(2, 3) << 1, 0, by.x - from.x, 0, 1, by.y - from.y);
    cv::Mat moved;
    cv::warpAffine(noise, moved, shift, size, cv::INTER_CUBIC, cv::BORDER_REFLECT);
    return moved;
  };
  cv::Mat picture = shifted(wall, {20, 20});
  cv::Mat mask(size, CV_8U, cv::Scalar(0));
  cv::ellipse(mask, cv::Point2d(0.5 * size.width, 0.5 * size.height) + figure, {size.width / 5, size.height / 3}, 0, 0,
              360, cv::Scalar(255), -1);
  shifted(figure, {60, 40}).copyTo(picture, mask);
  return picture;
}

cv::Mat reference(const cv::Mat& from, const cv::Mat& to) {
  cv::Mat flow;
  cv::calcOpticalFlowFarneback(from, to, flow, 0.5, 3, 15, 3, 5, 1.2, 0);
  return flow;
}

TEST(Farneback, IsTheFlowOfTheReferenceImplementation) {
  for (const cv::Size& size : {cv::Size(320, 180), cv::Size(180, 320), cv::Size(97, 71), cv::Size(40, 30)}) {
    SCOPED_TRACE(size);
    Farneback farneback;
    cv::Mat before;
    for (int i = 0; i < 4; ++i) {
      const cv::Mat now = scene(size, {1.7 * i, -0.6 * i}, {-2.3 * i, 1.1 * i});
      const cv::Mat flow = farneback.add(now);
      if (i == 0) {
        EXPECT_TRUE(flow.empty());
      } else {
        const cv::Mat expected = reference(before, now);
        EXPECT_LT(mean_length(flow - expected), 1e-3);
        EXPECT_LT(cv::norm(flow - expected, cv::NORM_INF), 0.05);
        EXPECT_NEAR(mean_length(flow), mean_length(expected), 1e-3);
      }
      before = now;
    }
  }
}

TEST(Farneback, MeanLengthIsThatOfTheTrueMotion) {
  const cv::Size size(320, 180);
  for (const cv::Point2d& shift : {cv::Point2d(0.5, 0), cv::Point2d(3, 4), cv::Point2d(-7, 2), cv::Point2d(11, 0)}) {
    Farneback farneback;
    farneback.add(scene(size, {0, 0}, {0, 0}));
    const cv::Mat flow = farneback.add(scene(size, shift, shift));
    // What comes in at the borders is not seen before.
    EXPECT_NEAR(mean_length(flow), cv::norm(shift), 0.05 * cv::norm(shift) + 0.05);
  }
}

TEST(Farneback, APictureWithoutDetailDoesNotMove) {
  Farneback farneback;
  farneback.add(cv::Mat(180, 320, CV_8U, cv::Scalar(128)));
  EXPECT_EQ(mean_length(farneback.add(cv::Mat(180, 320, CV_8U, cv::Scalar(128)))), 0.0);
}

}  // namespace
}  // namespace gyre
