// SPDX-License-Identifier: Apache-2.0
#include "offload/fit/inner_parts.h"

#include "common/geometry/pose.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace gyre {

void carry_inner_parts(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& before,
                       std::vector<Eigen::Vector3d>& after, int neighbours) {
  const TemplatePart* surroundings = body.part("body");
  if (surroundings == nullptr) return;
  for (const TemplatePart& part : body.parts) {
    if (part.name == "body" || part.vertex_count == 0) continue;
    const int first = part.first_vertex, last = part.first_vertex + part.vertex_count;
    std::vector<std::pair<double, int>> distances;
    for (int v = 0; v < surroundings->vertex_count; ++v) {
      double nearest = std::numeric_limits<double>::infinity();
      for (int p = first; p < last; ++p) nearest = std::min(nearest, (before[v] - before[p]).squaredNorm());
      distances.emplace_back(nearest, v);
    }
    const auto count = std::min<std::size_t>(neighbours, distances.size());
    std::partial_sort(distances.begin(), distances.begin() + static_cast<std::ptrdiff_t>(count), distances.end());
    std::vector<Eigen::Vector3d> from, to;
    Eigen::Vector3d shift = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < count; ++i) {
      from.push_back(before[distances[i].second]);
      to.push_back(after[distances[i].second]);
      shift += (to.back() - from.back()) / static_cast<double>(count);
    }
    const auto moved = align_points(to, from);
    const bool plausible = moved && moved->scale > 0.5 && moved->scale < 1.5;
    for (int p = first; p < last; ++p) after[p] = plausible ? *moved * before[p] : Eigen::Vector3d(before[p] + shift);
  }
}

}  // namespace gyre
