// SPDX-License-Identifier: Apache-2.0
// Points on the head, shoulders and trunk of somebody 1.7 m tall who faces +Z: no two samples share one.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace gyre {

struct SurfacePoint {
  Eigen::Vector3d position;
  Eigen::Vector3d normal;  // unit, outwards
};

// count points above `lowest` (metres over the floor), spread evenly over ellipsoids.
std::vector<SurfacePoint> sample_bust(int count, double lowest, std::uint64_t seed);

}  // namespace gyre
