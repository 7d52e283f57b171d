// SPDX-License-Identifier: Apache-2.0
// Tape measures of a body mesh, as anthropometric surveys define them.
#pragma once

#include "common/mesh/mesh.h"

#include <Eigen/Core>
#include <span>
#include <vector>

namespace gyre {

// Length of the convex hull (a tape does not follow hollows) around the cut of the triangles with the plane y = level,
// metres; 0 when nothing is cut.
double girth(const std::vector<Eigen::Vector3d>& vertices, std::span<const Eigen::Vector3i> triangles, double level);

// Difference of the largest and smallest y of the first `count` vertices, metres.
double stature(const std::vector<Eigen::Vector3d>& vertices, std::size_t count);

}  // namespace gyre
