// SPDX-License-Identifier: Apache-2.0
// Triangles that share an edge of the surface, texture seams or not.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace gyre {

struct SharedEdge {
  int face[2];    // triangles
  int vertex[2];  // ends of the edge
};

// One entry for every two triangles at an edge, ordered by the edge's vertices; an edge of three triangles gives two
// entries, as a strip would.
std::vector<SharedEdge> shared_edges(std::span<const Eigen::Vector3i> triangles);

}  // namespace gyre
