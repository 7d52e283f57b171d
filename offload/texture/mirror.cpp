// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/mirror.h"

#include "offload/texture/texel_graph.h"
#include "offload/texture/texel_solver.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace gyre {

namespace {

bool is_seen(const Canvas& canvas, std::size_t texel) {
  return canvas.photo[texel] >= 0;
}

// The triangle that mirrors each one, -1: none.
std::vector<int> mirror_triangles(const TriangleMesh& mesh, std::span<const int> mirror) {
  const auto sorted = [](std::array<int, 3> corners) {
    std::sort(corners.begin(), corners.end());
    return corners;
  };
  std::map<std::array<int, 3>, int> by_corners;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Eigen::Vector3i& c = mesh.triangles[t];
    by_corners[sorted({c[0], c[1], c[2]})] = static_cast<int>(t);
  }
  std::vector<int> other;
  other.reserve(mesh.triangles.size());
  for (const Eigen::Vector3i& c : mesh.triangles) {
    const auto found = by_corners.find(sorted({mirror[c[0]], mirror[c[1]], mirror[c[2]]}));
    other.push_back(found == by_corners.end() ? -1 : found->second);
  }
  return other;
}

// Where the mirror image of a texel lies in the texture, in texels.
Eigen::Vector2d mirrored_place(const TriangleMesh& mesh, const Atlas& atlas, std::span<const int> mirror,
                               std::size_t texel, int other) {
  const Eigen::Vector3d weights = corner_weights(atlas, texel);
  Eigen::Vector2d place = Eigen::Vector2d::Zero();
  for (int k = 0; k < 3; ++k) {
    const int vertex = mirror[mesh.triangles[atlas.triangle[texel]][k]];
    for (int j = 0; j < 3; ++j) {
      if (mesh.triangles[other][j] == vertex) place += weights[k] * mesh.uv[mesh.uv_triangles[other][j]];
    }
  }
  return place * atlas.size;
}

struct Copy {
  std::size_t texel = 0;
  Eigen::Vector3f colour;
  std::uint8_t confidence = 0;
};

// Bilinear colour of four texels that were all seen; fails otherwise.
bool copy_from(const Canvas& canvas, int size, const Eigen::Vector2d& place, Copy& copy) {
  const Eigen::Vector2d p = place.array() - 0.5;
  const auto x = static_cast<int>(std::floor(p.x()));
  const auto y = static_cast<int>(std::floor(p.y()));
  if (x < 0 || y < 0 || x + 1 >= size || y + 1 >= size) return false;
  copy.colour.setZero();
  copy.confidence = 255;
  for (const int dy : {0, 1}) {
    for (const int dx : {0, 1}) {
      const std::size_t i = static_cast<std::size_t>(y + dy) * size + x + dx;
      if (!is_seen(canvas, i)) return false;
      const double weight = (dx == 1 ? p.x() - x : x + 1 - p.x()) * (dy == 1 ? p.y() - y : y + 1 - p.y());
      copy.colour += static_cast<float>(weight) * canvas.colour[i];
      copy.confidence = std::min(copy.confidence, canvas.confidence[i]);
    }
  }
  return true;
}

// Mirrored texels, and the seen ones of the triangles at theirs.
std::vector<std::uint8_t> insertion_site(const TriangleMesh& mesh, const Atlas& atlas, const Canvas& canvas) {
  std::vector<std::uint8_t> at_vertex(mesh.vertices.size(), 0);
  for (std::size_t i = 0; i < atlas.texels(); ++i) {
    if (canvas.origin[i] != TexelOrigin::mirrored) continue;
    for (int k = 0; k < 3; ++k) at_vertex[mesh.triangles[atlas.triangle[i]][k]] = 1;
  }
  std::vector<std::uint8_t> wanted(atlas.texels(), 0);
  for (std::size_t i = 0; i < atlas.texels(); ++i) {
    if (atlas.triangle[i] < 0) continue;
    const Eigen::Vector3i& corners = mesh.triangles[atlas.triangle[i]];
    const bool near = at_vertex[corners[0]] != 0 || at_vertex[corners[1]] != 0 || at_vertex[corners[2]] != 0;
    wanted[i] = near && (is_seen(canvas, i) || canvas.origin[i] == TexelOrigin::mirrored) ? 1 : 0;
  }
  return wanted;
}

}  // namespace

void fill_mirrored(const TriangleMesh& mesh, const Atlas& atlas, std::span<const SharedEdge> edges,
                   std::span<const int> mirror, std::span<const std::uint8_t> skip, int threads, Canvas& canvas) {
  const std::vector<int> other = mirror_triangles(mesh, mirror);
  std::vector<Copy> copies;
  for (std::size_t i = 0; i < atlas.texels(); ++i) {
    const int t = atlas.triangle[i];
    if (t < 0 || skip[t] || other[t] < 0 || canvas.origin[i] != TexelOrigin::none) continue;
    Copy copy{.texel = i};
    if (copy_from(canvas, atlas.size, mirrored_place(mesh, atlas, mirror, i, other[t]), copy)) copies.push_back(copy);
  }
  for (const Copy& copy : copies) {
    canvas.colour[copy.texel] = copy.colour;
    canvas.origin[copy.texel] = TexelOrigin::mirrored;
    canvas.confidence[copy.texel] = copy.confidence / 2;
  }

  const TexelGraph graph = connect_texels(mesh, atlas, edges, insertion_site(mesh, atlas, canvas));
  constexpr float fixed = 1e5F;
  constexpr float pull = 1e-5F;  // of a part without any seen texel next to it
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
