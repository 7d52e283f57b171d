// SPDX-License-Identifier: Apache-2.0
// The two numbers of a frame that selection needs, from its picture.
#pragma once

#include "common/selection/farneback.h"
#include "common/selection/selection.h"

#include <opencv2/core/mat.hpp>
#include <opencv2/video/tracking.hpp>

namespace gyre {

// How flow is computed: as the paper does (Farneback, "Two-Frame Motion Estimation Based on Polynomial Expansion", SCIA
// 2003), or several times faster (Kroeger et al., "Fast Optical Flow using Dense Inverse Search", ECCV 2016).
enum class FlowMethod { farneback, dis };

struct MeasureOptions {
  FlowMethod flow = FlowMethod::farneback;
  // Longer side of the luma that flow is computed on. The rule does not change when all motion is scaled.
  int flow_size = 320;
  // Longer side of the luma that sharpness is computed on. At 320 a defocus of 2 pixels (of 1280) is averaged away; at
  // 1280 sensor noise makes up a good part of the variance; at 640 the two stay apart by a factor of two or more.
  int sharpness_size = 640;
};

// Flow along a sequence of frames.
class DenseFlow {
 public:
  explicit DenseFlow(FlowMethod method = FlowMethod::farneback) : method_(method) {}

  // The next frame, 8-bit luma, all of one size. Flow: CV_32FC2, pixels, where each pixel of the frame before is found
  // in this one; empty for the first frame.
  cv::Mat add(const cv::Mat& luma);

 private:
  FlowMethod method_;
  Farneback farneback_;
  cv::Ptr<cv::DISOpticalFlow> dis_;
  cv::Mat before_;
};

// Measures frame after frame of one pass; remembers the luma of the frame before.
class FrameMeter {
 public:
  explicit FrameMeter(const MeasureOptions& options = {}) : options_(options), flow_(options.flow) {}

  // 8-bit BGR, all of one size. Motion: mean length of the dense flow from the frame before. Sharpness: variance of the
  // 4-neighbour Laplacian (Pech-Pacheco et al., ICPR 2000).
  FrameMeasure measure(const cv::Mat& bgr);

  // What the last motion was measured on: luma with `flow_size` as its longer side.
  const cv::Mat& luma() const { return luma_; }

 private:
  MeasureOptions options_;
  DenseFlow flow_;
  cv::Mat luma_;
};

// The parts. Flow as DenseFlow gives it; luma of 8 bits, at most 4,000 pixels wide.
double mean_length(const cv::Mat& flow);
double laplacian_variance(const cv::Mat& luma);

// Luma of BGR or luma, reduced (never enlarged) by area averaging until its longer side is `longer_side`.
cv::Mat reduced_luma(const cv::Mat& picture, int longer_side);

}  // namespace gyre
