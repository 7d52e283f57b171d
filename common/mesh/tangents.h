// SPDX-License-Identifier: Apache-2.0
// Frames along the texture coordinates of a surface, in which normal maps are written.
#pragma once

#include "common/mesh/mesh.h"

#include <Eigen/Core>
#include <array>
#include <vector>

namespace gyre {

// The tangent at the three corners of every triangle, as glTF's TANGENT: x, y, z is a unit vector across the corner's
// normal that points to where u grows, w is 1 or -1 so that w * normal x tangent points to where v shrinks (up in the
// picture). Corners of one vertex and one texture coordinate have one tangent, the mean over their triangles weighted
// by the angles there (Mikkelsen, Simulation of Wrinkled Surfaces Revisited, 2008, section 5). normals: one a vertex,
// unit. Triangles without area in the texture count for nothing; a corner with only such ones gets any tangent.
std::vector<std::array<Eigen::Vector4f, 3>> corner_tangents(const TriangleMesh& mesh,
                                                            const std::vector<Eigen::Vector3d>& normals);

}  // namespace gyre
