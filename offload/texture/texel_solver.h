// SPDX-License-Identifier: Apache-2.0
// Smooth colour fields over the texels of a surface.
#pragma once

#include "common/mesh/mesh.h"
#include "offload/texture/atlas.h"
#include "offload/texture/texel_graph.h"

#include <Eigen/Core>
#include <span>
#include <vector>

namespace gyre {

// Solves (L + D) x = right with L the Laplacian of the graph (weight 1 an edge, links too) and D = diag(diagonal), a
// symmetric system that is positive definite when every connected part of the graph has a node with diagonal > 0. Two
// levels, conjugate gradients preconditioned by the additive sum of both (Bramble, Pasciak and Xu, Math. Comp. 55,
// 1990): the texels, by their diagonal, and the hat functions of the mesh's vertices, which know nothing of charts, by
// sparse Cholesky of their finite-element stiffness in texel units. Stops at `tolerance` of |right|. One colour a node.
std::vector<Eigen::Vector3f> solve_on_texels(const TriangleMesh& mesh, const Atlas& atlas, const TexelGraph& graph,
                                             std::span<const float> diagonal, std::vector<Eigen::Vector3f> right,
                                             double tolerance, int threads);

}  // namespace gyre
