// SPDX-License-Identifier: Apache-2.0
// Colour offsets that make neighbouring patches of different photographs meet without a step.
#pragma once

#include "offload/texture/face_graph.h"
#include "offload/texture/photo.h"

#include <Eigen/Core>
#include <span>
#include <vector>

namespace gyre {

// The photographs around a vertex, with the share of its triangles that use them, and the offset (encoded BGR) to add
// to each there.
struct VertexPatch {
  int photo = 0;
  float share = 0;
  Eigen::Vector3f offset = Eigen::Vector3f::Zero();
};

using VertexPatches = std::vector<std::vector<VertexPatch>>;

// Shares only, offsets 0. label: photograph of each triangle, -1: none.
VertexPatches patches_at_vertices(std::span<const Eigen::Vector3i> triangles, std::span<const int> label,
                                  std::size_t vertices);

struct LevelOptions {
  double smoothness = 0.3;  // weight of equal offsets along an edge inside a patch
  double anchor = 0.001;    // weight of no offset
};

// Global seam levelling (Lempitsky and Ivanov, CVPR 2007; Waechter et al., ECCV 2014, eq. 5): one offset a vertex and
// photograph, least squares over the steps at borders and the differences inside patches, by sparse Cholesky. Texture
// seams do not matter, because the unknowns live on the surface's vertices. Fills the offsets of `patches`.
void level_seams(std::span<const Eigen::Vector3d> vertices, std::span<const SharedEdge> edges,
                 std::span<const int> label, std::span<const Photo> photos, const LevelOptions& options,
                 VertexPatches& patches);

}  // namespace gyre
