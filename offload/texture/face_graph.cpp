// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/face_graph.h"

#include <algorithm>
#include <tuple>

namespace gyre {

std::vector<SharedEdge> shared_edges(std::span<const Eigen::Vector3i> triangles) {
  std::vector<std::tuple<int, int, int>> sides;  // low vertex, high vertex, triangle
  sides.reserve(3 * triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(triangles[t][k], triangles[t][(k + 1) % 3]);
      sides.emplace_back(low, high, static_cast<int>(t));
    }
  }
  std::sort(sides.begin(), sides.end());
  std::vector<SharedEdge> edges;
  for (std::size_t i = 1; i < sides.size(); ++i) {
    const auto& [a, b, t] = sides[i - 1];
    const auto& [c, d, u] = sides[i];
    if (a == c && b == d && t != u) edges.push_back({{t, u}, {a, b}});
  }
  return edges;
}

}  // namespace gyre
