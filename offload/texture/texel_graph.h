// SPDX-License-Identifier: Apache-2.0
// Which texels lie next to each other on the surface, within a chart and across its borders.
#pragma once

#include "common/mesh/mesh.h"
#include "offload/texture/atlas.h"
#include "offload/texture/face_graph.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace gyre {

// Nodes are chosen texels, grouped by triangle so that a triangle's are consecutive.
struct TexelGraph {
  std::vector<std::int32_t> texel;                     // of each node
  std::vector<std::int32_t> first;                     // triangles + 1: a triangle's nodes are [first[t], first[t + 1])
  std::vector<std::array<std::int32_t, 4>> neighbour;  // nodes right, below, left, above in the same chart; -1: none
  std::vector<std::array<std::int32_t, 2>> links;      // nodes on the two sides of a border that charts share
};

constexpr int opposite_side(int side) {
  return (side + 2) % 4;
}

// wanted: 1 for each texel that becomes a node (those without surface never do). edges: shared_edges(mesh.triangles).
TexelGraph connect_texels(const TriangleMesh& mesh, const Atlas& atlas, std::span<const SharedEdge> edges,
                          std::span<const std::uint8_t> wanted);

}  // namespace gyre
