// SPDX-License-Identifier: Apache-2.0
// Sees when somebody who turns before a camera that stands is back where they began.
#pragma once

#include "common/geometry/camera.h"

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

namespace gyre {

// The first view is remembered as ORB features (Rublee et al., ICCV 2011). Those in whose places the picture is another
// one as long as the subject is turned away are the subject's, the others the room's, which does not vote. Belongs to
// one thread.
class TurnClosure {
 public:
  // camera: of frames as they were recorded; the luma may be smaller.
  explicit TurnClosure(const Camera& camera) : camera_(camera) {}

  // The next frame, 8-bit luma, all of one size. True from the one on in which the subject has turned away and is back
  // to a few degrees. Only views that are sharp are looked at.
  bool add(const cv::Mat& luma, bool is_sharp);

 private:
  void remember(const cv::Mat& luma);
  std::vector<bool> changed(const cv::Mat& luma) const;
  std::vector<bool> subjects() const;
  std::optional<double> turn_to(const cv::Mat& luma, const std::vector<bool>& of) const;
  void look(const cv::Mat& luma);

  Camera camera_;
  cv::Mat first_;  // luma, smoothed
  std::vector<cv::KeyPoint> points_;
  cv::Mat descriptors_;
  std::vector<int> gone_;  // by point: looks that found it gone while the subject was turned away ...
  int looks_ = 0;          // ... of so many
  int frames_ = 0;         // since the last look
  int looks_away_ = 0;     // in a row
  bool is_away_ = false;
  std::optional<double> seen_;  // turn at the last look, when the first view was seen again
  bool is_closed_ = false;
};

}  // namespace gyre
