// SPDX-License-Identifier: Apache-2.0
#include "common/selection/measure.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

namespace gyre {

cv::Mat reduced_luma(const cv::Mat& bgr, int longer_side) {
  // Reduced before the conversion: both are linear, and the conversion then has fewer pixels to visit.
  cv::Mat small = bgr;
  const double scale = static_cast<double>(longer_side) / std::max(bgr.cols, bgr.rows);
  if (scale < 1.0) {
    const cv::Size size(std::max(1, static_cast<int>(std::lround(bgr.cols * scale))),
                        std::max(1, static_cast<int>(std::lround(bgr.rows * scale))));
    cv::resize(bgr, small, size, 0.0, 0.0, cv::INTER_AREA);
  }
  cv::Mat luma;
  cv::cvtColor(small, luma, cv::COLOR_BGR2GRAY);
  return luma;
}

cv::Mat dense_flow(const cv::Mat& from, const cv::Mat& to, FlowMethod method) {
  cv::Mat flow;
  if (method == FlowMethod::dis) {
    cv::DISOpticalFlow::create(cv::DISOpticalFlow::PRESET_FAST)->calc(from, to, flow);
    return flow;
  }
  constexpr double pyramid_scale = 0.5;
  constexpr int levels = 3;
  constexpr int window = 15;
  constexpr int iterations = 3;
  constexpr int neighbourhood = 5;
  constexpr double sigma = 1.2;
  cv::calcOpticalFlowFarneback(from, to, flow, pyramid_scale, levels, window, iterations, neighbourhood, sigma, 0);
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
  cv::Mat laplacian;
  cv::Laplacian(luma, laplacian, CV_16S, 1);
  cv::Scalar mean;
  cv::Scalar deviation;
  cv::meanStdDev(laplacian, mean, deviation);
  return deviation[0] * deviation[0];
}

FrameMeasure FrameMeter::measure(const cv::Mat& bgr) {
  cv::Mat luma = reduced_luma(bgr, options_.flow_size);
  FrameMeasure measure;
  measure.sharpness = laplacian_variance(reduced_luma(bgr, options_.sharpness_size));
  if (!luma_.empty()) {
    flow_ = dense_flow(luma_, luma, options_.flow);
    measure.motion = mean_length(flow_);
  }
  luma_ = std::move(luma);
  return measure;
}

}  // namespace gyre
