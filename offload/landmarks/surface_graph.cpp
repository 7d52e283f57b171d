// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/surface_graph.h"

#include "offload/landmarks/point_grid.h"

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <queue>
#include <tuple>

namespace gyre {

namespace {

constexpr double reach = 2.3;  // spacings: bridges one empty cube

// Means of the points in cubes; cubes in the order of their coordinates.
void thin(const PointCloud& cloud, double spacing, SurfaceGraph& graph) {
  struct Entry {
    Eigen::Vector3i cell;
    std::size_t point;
  };
  std::vector<Entry> entries;
  entries.reserve(cloud.points.size());
  for (std::size_t i = 0; i < cloud.points.size(); ++i)
    entries.push_back({(cloud.points[i].cast<double>() / spacing).array().floor().cast<int>(), i});
  const auto order = [](const Eigen::Vector3i& c) { return std::tuple(c.x(), c.y(), c.z()); };
  std::sort(entries.begin(), entries.end(), [&](const Entry& a, const Entry& b) {
    return std::tuple(order(a.cell), a.point) < std::tuple(order(b.cell), b.point);
  });
  for (std::size_t first = 0; first < entries.size();) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
    std::size_t last = first;
    for (; last < entries.size() && entries[last].cell == entries[first].cell; ++last) {
      sum += cloud.points[entries[last].point].cast<double>();
      if (!cloud.normals.empty()) normal += cloud.normals[entries[last].point].cast<double>();
    }
    graph.nodes.push_back(sum / static_cast<double>(last - first));
    graph.normals.push_back(normal.norm() > 1e-9 ? normal.normalized() : normal);
    first = last;
  }
}

void join_neighbours(SurfaceGraph& graph, double spacing) {
  const PointGrid grid(graph.nodes, reach * spacing);
  graph.edges.assign(graph.size(), {});
  for (std::size_t i = 0; i < graph.size(); ++i)
    grid.for_within(graph.nodes[i], reach * spacing, [&](std::uint32_t j, double squared) {
      if (j != i) graph.edges[i].emplace_back(static_cast<int>(j), std::sqrt(squared));
    });
}

// Number of the part each node belongs to, and the parts' sizes.
std::pair<std::vector<int>, std::vector<std::size_t>> parts_of(const SurfaceGraph& graph) {
  std::vector<int> part(graph.size(), -1);
  std::vector<std::size_t> sizes;
  std::vector<int> stack;
  for (std::size_t start = 0; start < graph.size(); ++start) {
    if (part[start] >= 0) continue;
    const int number = static_cast<int>(sizes.size());
    sizes.push_back(0);
    part[start] = number;
    stack.assign(1, static_cast<int>(start));
    while (!stack.empty()) {
      const int at = stack.back();
      stack.pop_back();
      ++sizes[number];
      for (const auto& [next, length] : graph.edges[at])
        if (part[next] < 0) {
          part[next] = number;
          stack.push_back(next);
        }
    }
  }
  return {part, sizes};
}

SurfaceGraph kept_nodes(const SurfaceGraph& graph, const std::vector<bool>& keep) {
  std::vector<int> renumbered(graph.size(), -1);
  SurfaceGraph kept;
  for (std::size_t i = 0; i < graph.size(); ++i) {
    if (!keep[i]) continue;
    renumbered[i] = static_cast<int>(kept.size());
    kept.nodes.push_back(graph.nodes[i]);
    kept.normals.push_back(graph.normals[i]);
    kept.edges.push_back(graph.edges[i]);
  }
  for (auto& edges : kept.edges) {
    std::erase_if(edges, [&](const auto& edge) { return !keep[edge.first]; });
    for (auto& [next, length] : edges) next = renumbered[next];
  }
  return kept;
}

int root(std::vector<int>& parents, int at) {
  while (parents[at] != at) at = parents[at] = parents[parents[at]];
  return at;
}

void tie_parts(SurfaceGraph& graph, const std::vector<int>& part, std::size_t parts, double bridge, double spacing) {
  if (parts < 2) return;
  // Shortest gap between every two parts, found from a sample of each part's nodes and then refined.
  std::vector<int> sample;
  const double coarse = 3 * spacing;
  std::map<std::tuple<int, int, int, int>, int> cells;
  for (std::size_t i = 0; i < graph.size(); ++i) {
    const Eigen::Vector3i c = (graph.nodes[i] / coarse).array().floor().cast<int>();
    if (cells.emplace(std::tuple(part[i], c.x(), c.y(), c.z()), static_cast<int>(i)).second)
      sample.push_back(static_cast<int>(i));
  }
  std::vector<Eigen::Vector3d> places;
  places.reserve(sample.size());
  for (const int i : sample) places.push_back(graph.nodes[i]);
  const PointGrid grid(places, bridge / 2);
  std::vector<std::size_t> sizes(parts, 0);
  for (const int i : sample) ++sizes[part[i]];
  const auto largest = std::max_element(sizes.begin(), sizes.end()) - sizes.begin();
  std::map<std::pair<int, int>, std::tuple<double, int, int>> gaps;
  for (const int i : sample) {
    if (part[i] == largest) continue;  // the other end of its gaps finds them
    grid.for_within(graph.nodes[i], bridge, [&](std::uint32_t k, double squared) {
      const int j = sample[k];
      if (part[j] == part[i]) return;
      const auto pair = std::minmax(part[i], part[j]);
      const auto gap = std::tuple(std::sqrt(squared), i, j);
      const auto [at, is_first] = gaps.emplace(pair, gap);
      if (!is_first && gap < at->second) at->second = gap;
    });
  }
  std::vector<std::tuple<double, int, int>> ties;
  for (const auto& [pair, gap] : gaps) ties.push_back(gap);
  std::sort(ties.begin(), ties.end());
  std::vector<int> parents(parts);
  std::iota(parents.begin(), parents.end(), 0);
  for (const auto& [length, i, j] : ties) {
    const int a = root(parents, part[i]), b = root(parents, part[j]);
    if (a == b) continue;
    parents[a] = b;
    graph.edges[i].emplace_back(j, length);
    graph.edges[j].emplace_back(i, length);
  }
}

}  // namespace

SurfaceGraph make_surface_graph(const PointCloud& cloud, const SurfaceGraphOptions& options) {
  SurfaceGraph graph;
  thin(cloud, options.spacing, graph);
  join_neighbours(graph, options.spacing);
  auto [part, sizes] = parts_of(graph);
  const auto smallest = options.smallest_share * static_cast<double>(graph.size());
  std::vector<bool> keep(graph.size());
  for (std::size_t i = 0; i < graph.size(); ++i) keep[i] = static_cast<double>(sizes[part[i]]) >= smallest;
  graph = kept_nodes(graph, keep);
  std::tie(part, sizes) = parts_of(graph);
  tie_parts(graph, part, sizes.size(), options.bridge, options.spacing);
  return graph;
}

std::vector<double> geodesic_distances(const SurfaceGraph& graph, std::span<const int> sources, double limit) {
  std::vector<double> distance(graph.size(), std::numeric_limits<double>::infinity());
  using Item = std::pair<double, int>;
  std::priority_queue<Item, std::vector<Item>, std::greater<>> queue;
  for (const int source : sources) {
    distance[source] = 0;
    queue.emplace(0.0, source);
  }
  while (!queue.empty()) {
    const auto [so_far, at] = queue.top();
    queue.pop();
    if (so_far > distance[at]) continue;
    for (const auto& [next, length] : graph.edges[at]) {
      const double reached = so_far + length;
      if (reached >= distance[next] || reached > limit) continue;
      distance[next] = reached;
      queue.emplace(reached, next);
    }
  }
  return distance;
}

}  // namespace gyre
