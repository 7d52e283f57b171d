// SPDX-License-Identifier: Apache-2.0
// Two-view geometry: which matches of a pair can be the same rigid scene, and how its two cameras then stand.
#pragma once

#include "common/geometry/pose.h"
#include "offload/cameras/matching.h"

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

namespace gyre {

struct VerificationOptions {
  double max_error = 3.0;  // Sampson distance to the fundamental matrix, pixels
  double confidence = 0.9999;
  int max_iterations = 5000;
  int min_inliers = 20;
};

// The matches that agree with the fundamental matrix most of them agree with (MAGSAC++, Barath et al., CVPR 2020, as in
// OpenCV's USAC, with fixed seed); none when fewer than min_inliers do. Needs no camera.
std::vector<Match> verify_matches(std::span<const Eigen::Vector2d> pixels_a, std::span<const Eigen::Vector2d> pixels_b,
                                  std::span<const Match> matches, const VerificationOptions& options = {});

// E with x_b^T E x_a = 0 for normalised image points (Hartley and Zisserman, eq. 9.12).
Eigen::Matrix3d essential_matrix(const Pose& b_from_a);

// First-order distance of two normalised points from x_b^T E x_a = 0 (Hartley and Zisserman, eq. 11.9, root).
double sampson_distance(const Eigen::Matrix3d& essential, const Eigen::Vector2d& a, const Eigen::Vector2d& b);

struct RelativePose {
  Pose b_from_a;               // translation of unit length
  std::vector<Match> inliers;  // agree with it and lie in front of both cameras
  double median_angle = 0.0;   // between the rays of the inliers, radians
};

// Relative pose from matched normalised points by five-point RANSAC (Nister, PAMI 2004) with fixed seed; max_error is
// in normalised units. Nothing when no pose explains 8 matches.
std::optional<RelativePose> relative_pose(std::span<const Eigen::Vector2d> normalised_a,
                                          std::span<const Eigen::Vector2d> normalised_b, std::span<const Match> matches,
                                          double max_error);

}  // namespace gyre
