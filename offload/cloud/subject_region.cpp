// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/subject_region.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace gyre {

bool is_floor(double height, double up, const FloorOptions& options) {
  return height < options.certain_height ||
         (height < options.height && up > std::cos(options.max_angle_deg * std::numbers::pi / 180.0));
}

std::optional<RayInterval> intersect(const SubjectRegion& region, const Eigen::Vector3d& origin,
                                     const Eigen::Vector3d& direction) {
  double near = 0.0;
  double far = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    if (direction[axis] == 0.0) {
      if (origin[axis] < region.min[axis] || origin[axis] > region.max[axis]) return std::nullopt;
      continue;
    }
    const double a = (region.min[axis] - origin[axis]) / direction[axis];
    const double b = (region.max[axis] - origin[axis]) / direction[axis];
    near = std::max(near, std::min(a, b));
    far = std::min(far, std::max(a, b));
  }
  if (near >= far) return std::nullopt;
  return RayInterval{near, far};
}

}  // namespace gyre
