// SPDX-License-Identifier: Apache-2.0
// Where the subject can be: the box of the cameras stage without the floor, and what of it a pixel's ray meets.
#pragma once

#include <Eigen/Core>
#include <optional>

namespace gyre {

// Axis-aligned box in the world, metres.
struct SubjectRegion {
  Eigen::Vector3d min = Eigen::Vector3d::Zero();
  Eigen::Vector3d max = Eigen::Vector3d::Zero();

  bool contains(const Eigen::Vector3d& x) const {
    return (x.array() >= min.array()).all() && (x.array() <= max.array()).all();
  }
  Eigen::Vector3d centre() const { return 0.5 * (min + max); }
};

struct FloorOptions {
  double height = 0.015;          // metres; what is below it with a normal within max_angle of up is floor
  double certain_height = 0.004;  // metres; what is below it is floor whatever its normal
  double max_angle_deg = 35.0;
};

// Whether a piece of surface `height` metres above the plane y = 0, with `up` the cosine of its normal to +Y, is floor.
bool is_floor(double height, double up, const FloorOptions& options);

// Part of the ray origin + t * direction inside the box, t >= 0 in units of the direction; nothing when it misses.
// Slab test (Kay and Kajiya, SIGGRAPH 1986).
struct RayInterval {
  double near = 0.0;
  double far = 0.0;
};
std::optional<RayInterval> intersect(const SubjectRegion& region, const Eigen::Vector3d& origin,
                                     const Eigen::Vector3d& direction);

}  // namespace gyre
