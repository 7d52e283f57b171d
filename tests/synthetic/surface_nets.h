// SPDX-License-Identifier: Apache-2.0
// The zero surface of a function in space as a triangle mesh.
#pragma once

#include "common/mesh/mesh.h"

#include <Eigen/Geometry>
#include <functional>

namespace gyre::synthetic {

using ScalarField = std::function<double(const Eigen::Vector3d&)>;

// Naive surface nets (Gibson, "Constrained elastic surface nets", MICCAI 1998) on a grid of `cell` metres over `box`:
// one vertex in every cell the surface crosses, then moved onto the surface by Newton steps along the gradient. `field`
// is negative inside, changes by at most 2 a metre and must be positive on the box's border; normals come from its
// gradient.
TriangleMesh polygonise(const ScalarField& field, const Eigen::AlignedBox3d& box, double cell);

}  // namespace gyre::synthetic
