// SPDX-License-Identifier: Apache-2.0
// How far away the subject is, and how that changes.
#pragma once

#include "common/geometry/camera.h"
#include "device/analysis/view_map.h"

#include <optional>
#include <vector>

namespace gyre {

// Whether a normalised image point lies in the upright ellipse in the middle of the picture that a framed subject
// fills.
bool is_in_the_middle(const Camera& camera, const Eigen::Vector2d& at);

// Distances are depths in the camera's axes, in the map's unit of length. A camera that goes around somebody has them
// at the radius of its way: points much nearer or farther are not theirs.
class SubjectDistance {
 public:
  // To what stands nearest in the middle of the picture.
  double nearest() const { return nearest_; }
  // To the middle of the points that stand where the camera's way turns around, as soon as it turned.
  double depth() const { return depth_; }
  // Logarithm of the distance against the first, from how the depths of the same points changed from frame to frame.
  double log_distance() const { return log_distance_; }
  // Whether a point at that depth belongs to the subject, as far as depth tells.
  bool is_near(double depth) const;

  // Takes what changed since the frame before. camera: of the map's pictures.
  void follow(const ViewMap& map, const Camera& camera, const Pose& before, const View& now);
  // At a view. depths: of the points in the middle of the picture. radius: of the camera's way, where it turns.
  void measure_nearest(std::vector<double> depths);
  void measure_depth(std::vector<double> depths, const std::optional<double>& radius);

 private:
  double nearest_ = 1.0;
  double depth_ = 1.0;
  bool depth_known_ = false;
  double log_distance_ = 0.0;
};

// Share of the depths at which somebody stands whom the camera goes around at that radius; nothing without a radius.
std::optional<double> subject_share(const std::vector<double>& depths, const std::optional<double>& radius);

}  // namespace gyre
