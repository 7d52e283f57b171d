// SPDX-License-Identifier: Apache-2.0
// Rigid and similarity transforms, named a_from_b by whoever holds them.
#pragma once

#include "common/result/result.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>

namespace gyre {

// x_a = rotation * x_b + translation, in metres.
struct Pose {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& x) const { return rotation * x + translation; }
  Pose operator*(const Pose& b_from_c) const {
    return {rotation * b_from_c.rotation, rotation * b_from_c.translation + translation};
  }
  Pose inverse() const {
    const Eigen::Quaterniond r = rotation.conjugate();
    return {r, -(r * translation)};
  }
  Eigen::Matrix4d matrix() const;
};

// Centre of a camera in the world.
inline Eigen::Vector3d centre_of(const Pose& cam_from_world) {
  return -(cam_from_world.rotation.conjugate() * cam_from_world.translation);
}

// Angle of the rotation a * b^-1, radians in [0, pi].
double angle_between(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b);

// The rotation by |w| radians about w.
Eigen::Quaterniond rotation_about(const Eigen::Vector3d& w);

// x_a = scale * rotation * x_b + translation.
struct Similarity {
  double scale = 1.0;
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& x) const { return scale * (rotation * x) + translation; }
  Similarity operator*(const Similarity& b_from_c) const {
    return {scale * b_from_c.scale, rotation * b_from_c.rotation,
            scale * (rotation * b_from_c.translation) + translation};
  }
  Similarity inverse() const {
    const Eigen::Quaterniond r = rotation.conjugate();
    return {1.0 / scale, r, -(r * translation) / scale};
  }
  Eigen::Matrix4d matrix() const;
};

// The camera pose after the world it looks at is moved by b_from_a; the camera's own axes keep their unit length, so
// its distances scale with the world.
Pose cam_from_moved_world(const Pose& cam_from_a, const Similarity& b_from_a);

// Least-squares a_from_b for matched points (Umeyama, PAMI 1991, eq. 40-43). with_scale false keeps scale at 1.
// Error when fewer than three pairs, or all points on a line.
Result<Similarity> align_points(std::span<const Eigen::Vector3d> a, std::span<const Eigen::Vector3d> b,
                                bool with_scale = true);

}  // namespace gyre
