// SPDX-License-Identifier: Apache-2.0
// Recognises a view that was seen before, and tells how the camera is turned against it.
#pragma once

#include "common/geometry/camera.h"

#include <Eigen/Geometry>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

namespace gyre {

// One remembered view: ORB features (Rublee et al., ICCV 2011). Belongs to one thread.
class RememberedView {
 public:
  // camera: of frames as recorded; luma: 8-bit, may be smaller.
  RememberedView(const Camera& camera, const cv::Mat& luma);

  // now_from_then, when enough features of the two views agree on one motion.
  std::optional<Eigen::Quaterniond> turn_to(const cv::Mat& luma) const;

 private:
  Camera camera_;
  std::vector<cv::KeyPoint> points_;
  cv::Mat descriptors_;
};

}  // namespace gyre
