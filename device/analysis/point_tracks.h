// SPDX-License-Identifier: Apache-2.0
// Points followed from frame to frame.
#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

namespace gyre {

struct PointTracksOptions {
  int most = 150;           // points followed at the same time
  double spacing = 8.0;     // between new points, pixels
  int window = 11;          // side of the patch that is followed, pixels
  int levels = 3;           // of the pyramid, each half as large
  double round_trip = 0.7;  // a point followed there and back ends within this of where it began, pixels
};

// Corners (Shi and Tomasi, "Good Features to Track", CVPR 1994) followed by pyramidal Lucas-Kanade (Bouguet 2000),
// dropped when the way back does not agree (Kalal et al., "Forward-Backward Error", ICPR 2010).
class PointTracks {
 public:
  explicit PointTracks(const PointTracksOptions& options = {}) : options_(options) {}

  // Follows all points into the next frame, 8-bit luma of the same size.
  void add(const cv::Mat& luma);

  // New points join in the frame added last, where there are none.
  void refill();

  // Where the points are now (the first pixel's centre is (0, 0)), and a number for each that none has again.
  const std::vector<cv::Point2f>& positions() const { return positions_; }
  const std::vector<int>& ids() const { return ids_; }

 private:
  PointTracksOptions options_;
  cv::Mat luma_;
  std::vector<cv::Mat> pyramid_, view_pyramid_;  // of the last frame, and of the one where points last joined
  std::vector<cv::Point2f> positions_, view_positions_;
  std::vector<int> ids_;
  int next_id_ = 0;
};

}  // namespace gyre
