// SPDX-License-Identifier: Apache-2.0
// Pose of one view from points of the world it sees.
#pragma once

#include "common/geometry/pose.h"

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

namespace gyre {

struct Resection {
  Pose cam_from_world;
  std::vector<int> inliers;  // indices into the given points
};

// Pose from normalised image points and the world points they show, by RANSAC over minimal P3P samples (Ke and
// Roumeliotis, CVPR 2017) with fixed seed, refined on the inliers. max_error in normalised units. Nothing when fewer
// than min_inliers agree.
std::optional<Resection> resect(std::span<const Eigen::Vector2d> normalised, std::span<const Eigen::Vector3d> points,
                                double max_error, int min_inliers);

// The pose by which the points lie where they are seen with the least robust error: Gauss-Newton from `pose` with
// Cauchy weights of the given width (of the normalised plane). Points behind the camera do not count.
Pose refine_pose(Pose pose, std::span<const Eigen::Vector2d> normalised, std::span<const Eigen::Vector3d> points,
                 double width);

}  // namespace gyre
