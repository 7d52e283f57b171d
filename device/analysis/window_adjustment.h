// SPDX-License-Identifier: Apache-2.0
// Bundle adjustment of a few views at camera rate.
#pragma once

#include "common/geometry/pose.h"

#include <Eigen/Core>
#include <span>
#include <vector>

namespace gyre {

// A point seen by a view: normalised image point (x/z, y/z).
struct Sighting {
  int point = 0;  // index
  Eigen::Vector2d at = Eigen::Vector2d::Zero();
};

struct WindowView {
  Pose cam_from_world;
  std::vector<Sighting> sightings;
};

struct AdjustmentOptions {
  // Of the Cauchy loss, normalised image units: 1.5 times the median error, within these bounds.
  double least_scale = 0.0003;
  double largest_scale = 0.004;
  int iterations = 8;
};

// Moves all points and the views from number `fixed` on to the least sum of Cauchy losses of the reprojection errors:
// Levenberg-Marquardt with the points eliminated (Triggs et al., "Bundle adjustment - a modern synthesis", 1999).
// Points seen fewer than twice stay as they are.
void adjust_window(std::span<WindowView> views, std::size_t fixed, std::span<Eigen::Vector3d> points,
                   const AdjustmentOptions& options = {});

// The pose of one view over points that stay. cam_from_world: where it may be.
Pose resected(Pose cam_from_world, std::span<const Sighting> sightings, std::span<const Eigen::Vector3d> points,
              const AdjustmentOptions& options = {});

// Distance of a sighting to its point's projection; infinite behind the camera.
double reprojection_error(const Pose& cam_from_world, const Eigen::Vector3d& point, const Eigen::Vector2d& at);

}  // namespace gyre
