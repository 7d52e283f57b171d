// SPDX-License-Identifier: Apache-2.0
// The axis about which a subject turns before a fixed camera.
#pragma once

#include "common/geometry/pose.h"

#include <Eigen/Core>
#include <optional>
#include <span>

namespace gyre {

// A line in the subject's frame.
struct TurnAxis {
  Eigen::Vector3d direction = Eigen::Vector3d::UnitY();  // unit length, up in the pictures
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
};

// The axis that stays where it is before the camera: the direction u and the point p for which R_i u and R_i p + t_i
// differ least, in least squares re-weighted against a few poses off the rest (with A_i = R_i - mean R, u is the null
// direction of the sum of A_i^T A_i, and p solves the same normal equations across u: the fixed line of a rotation,
// Hartley and Zisserman, section 3.4.1, for all pairs of poses at once). Nothing when the poses turn by less than some
// 20 degrees in all.
std::optional<TurnAxis> turn_axis(std::span<const Pose> cam_from_subject);

}  // namespace gyre
