// SPDX-License-Identifier: Apache-2.0
// Colour offsets that make neighbouring patches of different photographs meet without a step.
#pragma once

#include "offload/texture/face_graph.h"
#include "offload/texture/observations.h"

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
  double anchor = 0.01;     // weight of no offset: keeps a step from tinting more than some ten triangles around
};

// Global seam levelling (Lempitsky and Ivanov, CVPR 2007; Waechter et al., ECCV 2014, eq. 5): one offset a vertex and
// photograph, least squares over the steps at borders and the differences inside patches, by sparse Cholesky. Texture
// seams do not matter, because the unknowns live on the surface's vertices. A step is measured only where both
// photographs see the border: at a crease it may lie on the silhouette of one. Fills the offsets of `patches`.
void level_seams(const PhotographedSurface& surface, std::span<const SharedEdge> edges, std::span<const int> label,
                 const LevelOptions& options, VertexPatches& patches);

}  // namespace gyre
