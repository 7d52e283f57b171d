// SPDX-License-Identifier: Apache-2.0
// How a camera with a known lens moved between two frames, from points seen in both.
#pragma once

#include "common/geometry/camera.h"
#include "common/geometry/pose.h"

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

namespace gyre {

struct RelativePoseOptions {
  double noise = 0.5;         // of a point, pixels
  double least_inliers = 12;  // agreeing points below which nothing is said
  double min_share = 0.5;     // of the points that have to agree
};

struct RelativePose {
  Pose b_from_a;              // translation of length 1, or zero when no parallax is seen
  std::vector<double> error;  // of each match, pixels: distance to its epipolar line, or to where the turn puts it
  std::vector<double> depth;  // of each match in a, units of the translation; 0 where it cannot be told
  bool has_parallax() const { return !b_from_a.translation.isZero(); }
};

// Matches in pixels (the first pixel's centre is (0.5, 0.5)), taken within a turn of a quarter. First a turn on the
// spot, which is taken when it explains the matches; else the essential matrix by RANSAC over five-point solutions
// (Nister, "An Efficient Solution to the Five-Point Relative Pose Problem", PAMI 2004) with a fixed seed, refined on
// the Sampson distance (Hartley and Zisserman, eq. 11.9) with Cauchy weights. Nothing when too few matches agree.
std::optional<RelativePose> relative_pose(std::span<const Eigen::Vector2d> a, std::span<const Eigen::Vector2d> b,
                                          const Camera& camera, const RelativePoseOptions& options = {});

}  // namespace gyre
