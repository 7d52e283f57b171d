// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/insertion.h"

#include "offload/texture/texel_graph.h"
#include "offload/texture/texel_solver.h"

#include <vector>

namespace gyre {

namespace {

bool is_seen(const Canvas& canvas, std::size_t texel) {
  return canvas.photo[texel] >= 0;
}

// Inserted texels, and the seen ones of the triangles at theirs.
std::vector<std::uint8_t> insertion_site(const TriangleMesh& mesh, const Atlas& atlas, const Canvas& canvas,
                                         std::span<const std::uint8_t> inserted) {
  std::vector<std::uint8_t> at_vertex(mesh.vertices.size(), 0);
  for (std::size_t i = 0; i < atlas.texels(); ++i) {
    if (inserted[i] == 0) continue;
    for (int k = 0; k < 3; ++k) at_vertex[mesh.triangles[atlas.triangle[i]][k]] = 1;
  }
  std::vector<std::uint8_t> wanted(atlas.texels(), 0);
  for (std::size_t i = 0; i < atlas.texels(); ++i) {
    if (atlas.triangle[i] < 0) continue;
    const Eigen::Vector3i& corners = mesh.triangles[atlas.triangle[i]];
    const bool near = at_vertex[corners[0]] != 0 || at_vertex[corners[1]] != 0 || at_vertex[corners[2]] != 0;
    wanted[i] = near && (is_seen(canvas, i) || inserted[i] != 0) ? 1 : 0;
  }
  return wanted;
}

}  // namespace

void insert_texels(const TriangleMesh& mesh, const Atlas& atlas, std::span<const SharedEdge> edges,
                   std::span<const std::uint8_t> inserted, double reach, int threads, Canvas& canvas) {
  const TexelGraph graph = connect_texels(mesh, atlas, edges, insertion_site(mesh, atlas, canvas, inserted));
  constexpr float fixed = 1e5F;
  constexpr double least_pull = 1e-5;  // for a part without any seen texel next to it
  const auto pull = static_cast<float>(reach > 0 ? 1.0 / (reach * reach) : least_pull);
  std::vector<float> diagonal(graph.texel.size());
  std::vector<Eigen::Vector3f> right(graph.texel.size(), Eigen::Vector3f::Zero());
  for (std::size_t n = 0; n < diagonal.size(); ++n) diagonal[n] = is_seen(canvas, graph.texel[n]) ? fixed : pull;
  const auto meet = [&](std::int32_t a, std::int32_t b) {
    if (is_seen(canvas, graph.texel[a]) == is_seen(canvas, graph.texel[b])) return;
    const Eigen::Vector3f step = canvas.colour[graph.texel[a]] - canvas.colour[graph.texel[b]];
    right[a] -= step;
    right[b] += step;
  };
  for (std::size_t n = 0; n < graph.texel.size(); ++n) {
    for (const int side : {0, 1}) {
      if (graph.neighbour[n][side] >= 0) meet(static_cast<std::int32_t>(n), graph.neighbour[n][side]);
    }
  }
  for (const auto& [a, b] : graph.links) meet(a, b);
  constexpr double tolerance = 1e-3;
  const auto offset = solve_on_texels(mesh, atlas, graph, diagonal, std::move(right), tolerance, threads);
  for (std::size_t n = 0; n < offset.size(); ++n) {
    if (!is_seen(canvas, graph.texel[n])) canvas.colour[graph.texel[n]] += offset[n];
  }
}

}  // namespace gyre
