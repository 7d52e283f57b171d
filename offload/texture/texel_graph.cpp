// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/texel_graph.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace gyre {

namespace {

int root_of(std::vector<int>& parent, int i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

// One number a triangle, equal within a chart.
std::vector<int> charts_of(const TriangleMesh& mesh) {
  std::vector<int> parent(mesh.uv.size());
  std::iota(parent.begin(), parent.end(), 0);
  for (const Eigen::Vector3i& t : mesh.uv_triangles) {
    for (int k = 1; k < 3; ++k) parent[root_of(parent, t[k])] = root_of(parent, t[0]);
  }
  std::vector<int> chart;
  chart.reserve(mesh.uv_triangles.size());
  for (const Eigen::Vector3i& t : mesh.uv_triangles) chart.push_back(root_of(parent, t[0]));
  return chart;
}

// A triangle's side that a chart ends at, in texels.
struct BorderSide {
  int triangle = 0;
  Eigen::Vector2i uv;  // of the edge's two vertices
  Eigen::Vector2d from, to, inwards;

  BorderSide(const TriangleMesh& mesh, const SharedEdge& edge, int side, int size) : triangle(edge.face[side]) {
    const Eigen::Vector3i& corners = mesh.triangles[triangle];
    const Eigen::Vector3i& places = mesh.uv_triangles[triangle];
    Eigen::Vector2d third = Eigen::Vector2d::Zero();
    for (int k = 0; k < 3; ++k) {
      if (corners[k] == edge.vertex[0]) {
        uv[0] = places[k];
      } else if (corners[k] == edge.vertex[1]) {
        uv[1] = places[k];
      } else {
        third = mesh.uv[places[k]] * size;
      }
    }
    from = mesh.uv[uv[0]] * size;
    to = mesh.uv[uv[1]] * size;
    const Eigen::Vector2d along = (to - from).normalized();
    const Eigen::Vector2d across(-along.y(), along.x());
    inwards = across.dot(third - from) < 0 ? Eigen::Vector2d(-across) : across;
  }
};

}  // namespace

TexelGraph connect_texels(const TriangleMesh& mesh, const Atlas& atlas, std::span<const SharedEdge> edges,
                          std::span<const std::uint8_t> wanted) {
  TexelGraph graph;
  graph.first.assign(mesh.triangles.size() + 1, 0);
  const auto is_node = [&](std::size_t i) { return wanted[i] != 0 && atlas.triangle[i] >= 0; };
  for (std::size_t i = 0; i < atlas.texels(); ++i) {
    if (is_node(i)) ++graph.first[atlas.triangle[i] + 1];
  }
  std::partial_sum(graph.first.begin(), graph.first.end(), graph.first.begin());
  graph.texel.resize(graph.first.back());
  std::vector<std::int32_t> node(atlas.texels(), -1);
  std::vector<std::int32_t> next(graph.first.begin(), graph.first.end() - 1);
  for (std::size_t i = 0; i < atlas.texels(); ++i) {
    if (!is_node(i)) continue;
    node[i] = next[atlas.triangle[i]]++;
    graph.texel[node[i]] = static_cast<std::int32_t>(i);
  }

  const std::vector<int> chart = charts_of(mesh);
  const auto chart_at = [&](std::int32_t texel) { return chart[atlas.triangle[texel]]; };
  graph.neighbour.assign(graph.texel.size(), {-1, -1, -1, -1});
  const auto join = [&](std::int32_t a, std::int32_t other_texel, int side) {
    const std::int32_t b = node[other_texel];
    if (b < 0 || chart_at(graph.texel[a]) != chart_at(other_texel)) return;
    graph.neighbour[a][side] = b;
    graph.neighbour[b][opposite_side(side)] = a;
  };
  for (std::size_t n = 0; n < graph.texel.size(); ++n) {
    const std::int32_t i = graph.texel[n];
    if (i % atlas.size + 1 < atlas.size) join(static_cast<std::int32_t>(n), i + 1, 0);
    if (i / atlas.size + 1 < atlas.size) join(static_cast<std::int32_t>(n), i + atlas.size, 1);
  }

  for (const SharedEdge& edge : edges) {
    const BorderSide a(mesh, edge, 0, atlas.size);
    const BorderSide b(mesh, edge, 1, atlas.size);
    if (a.uv == b.uv) continue;
    const double length = std::max((a.to - a.from).norm(), (b.to - b.from).norm());
    const int steps = std::max(1, static_cast<int>(std::ceil(length)));
    const auto node_at = [&](const BorderSide& side, double t) {
      const Eigen::Vector2d p = side.from + t * (side.to - side.from) + 0.5 * side.inwards;
      if (p.minCoeff() < 0 || p.maxCoeff() >= atlas.size) return -1;
      const auto texel = static_cast<std::int32_t>(p.y()) * atlas.size + static_cast<std::int32_t>(p.x());
      return node[texel] >= 0 && chart_at(texel) == chart[side.triangle] ? node[texel] : -1;
    };
    for (int k = 0; k < steps; ++k) {
      const double t = (k + 0.5) / steps;
      const std::int32_t n = node_at(a, t);
      const std::int32_t m = node_at(b, t);
      if (n >= 0 && m >= 0 && n != m) graph.links.push_back({std::min(n, m), std::max(n, m)});
    }
  }
  std::sort(graph.links.begin(), graph.links.end());
  graph.links.erase(std::unique(graph.links.begin(), graph.links.end()), graph.links.end());
  return graph;
}

}  // namespace gyre
