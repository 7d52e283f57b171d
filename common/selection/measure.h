// SPDX-License-Identifier: Apache-2.0
// The two numbers of a frame that selection needs, from its picture.
#pragma once

#include "common/selection/selection.h"

#include <opencv2/core/mat.hpp>

namespace gyre {

struct MeasureOptions {
  // Longer side of the luma that flow is computed on. The rule does not change when all motion is scaled.
  int flow_size = 320;
  // Longer side of the luma that sharpness is computed on. At 320 a defocus of 2 pixels (of 1280) is averaged away; at
  // 1280 sensor noise makes up a good part of the variance; at 640 the two stay apart by a factor of two or more.
  int sharpness_size = 640;
};

// Measures frame after frame of one pass; remembers the luma of the frame before.
class FrameMeter {
 public:
  explicit FrameMeter(const MeasureOptions& options = {}) : options_(options) {}

  // 8-bit BGR, all of one size. Motion: mean length of the dense flow (Farneback, "Two-Frame Motion Estimation Based on
  // Polynomial Expansion", SCIA 2003) from the frame before. Sharpness: variance of the 4-neighbour Laplacian
  // (Pech-Pacheco et al., ICPR 2000).
  FrameMeasure measure(const cv::Mat& bgr);

 private:
  MeasureOptions options_;
  cv::Mat previous_;
};

// The parts, on 8-bit luma.
double mean_flow(const cv::Mat& from, const cv::Mat& to);
double laplacian_variance(const cv::Mat& luma);

// Luma reduced (never enlarged) by area averaging until its longer side is `longer_side`.
cv::Mat reduced_luma(const cv::Mat& bgr, int longer_side);

}  // namespace gyre
