// SPDX-License-Identifier: Apache-2.0
#include "common/selection/measure.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

namespace gyre {

cv::Mat reduced_luma(const cv::Mat& picture, int longer_side) {
  // Reduced before the conversion: both are linear, and the conversion then has fewer pixels to visit.
  cv::Mat small = picture;
  const double scale = static_cast<double>(longer_side) / std::max(picture.cols, picture.rows);
  if (scale < 1.0) {
    const cv::Size size(std::max(1, static_cast<int>(std::lround(picture.cols * scale))),
                        std::max(1, static_cast<int>(std::lround(picture.rows * scale))));
    cv::resize(picture, small, size, 0.0, 0.0, cv::INTER_AREA);
  }
  if (small.channels() == 1) return small;
  cv::Mat luma;
  cv::cvtColor(small, luma, cv::COLOR_BGR2GRAY);
  return luma;
}

cv::Mat DenseFlow::add(const cv::Mat& luma) {
  if (method_ == FlowMethod::farneback) return farneback_.add(luma);
  cv::Mat flow;
  if (!dis_) dis_ = cv::DISOpticalFlow::create(cv::DISOpticalFlow::PRESET_FAST);
  if (!before_.empty()) dis_->calc(before_, luma, flow);
  before_ = luma;
  return flow;
}

double mean_length(const cv::Mat& flow) {
  double sum = 0.0;
  for (int y = 0; y < flow.rows; ++y) {
    const auto* row = flow.ptr<cv::Point2f>(y);
    for (int x = 0; x < flow.cols; ++x) sum += std::sqrt(row[x].x * row[x].x + row[x].y * row[x].y);
  }
  return sum / static_cast<double>(flow.total());
}

double laplacian_variance(const cv::Mat& luma) {
  std::int64_t sum = 0, squares = 0;
  for (int y = 0; y < luma.rows; ++y) {
    const auto* const row = luma.ptr<std::uint8_t>(y);
    const auto* const above = luma.ptr<std::uint8_t>(cv::borderInterpolate(y - 1, luma.rows, cv::BORDER_REFLECT_101));
    const auto* const below = luma.ptr<std::uint8_t>(cv::borderInterpolate(y + 1, luma.rows, cv::BORDER_REFLECT_101));
    std::int32_t row_sum = 0;
    std::uint32_t row_squares = 0;
    const auto add = [&](int x, int left, int right) {
      const int value = row[left] + row[right] + above[x] + below[x] - 4 * row[x];
      row_sum += value;
      row_squares += static_cast<std::uint32_t>(value * value);
    };
    for (int x = 1; x + 1 < luma.cols; ++x) add(x, x - 1, x + 1);
    for (const int x : {0, luma.cols - 1}) {
      add(x, cv::borderInterpolate(x - 1, luma.cols, cv::BORDER_REFLECT_101),
          cv::borderInterpolate(x + 1, luma.cols, cv::BORDER_REFLECT_101));
    }
    sum += row_sum;
    squares += row_squares;
  }
  const auto count = static_cast<double>(luma.total());
  const double mean = static_cast<double>(sum) / count;
  return static_cast<double>(squares) / count - mean * mean;
}

FrameMeasure FrameMeter::measure(const cv::Mat& bgr) {
  const cv::Mat detail = reduced_luma(bgr, options_.sharpness_size);
  // What is reduced further is small already.
  luma_ = reduced_luma(options_.flow_size <= options_.sharpness_size ? detail : bgr, options_.flow_size);
  FrameMeasure measure;
  measure.sharpness = laplacian_variance(detail);
  const cv::Mat flow = flow_.add(luma_);
  if (!flow.empty()) measure.motion = mean_length(flow);
  return measure;
}

}  // namespace gyre
