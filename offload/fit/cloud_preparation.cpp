// SPDX-License-Identifier: Apache-2.0
#include "offload/fit/cloud_preparation.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <tuple>

namespace gyre {

namespace {

using Cell = std::array<int, 3>;

Cell cell_of(const Eigen::Vector3d& p, double size) {
  return {static_cast<int>(std::floor(p.x() / size)), static_cast<int>(std::floor(p.y() / size)),
          static_cast<int>(std::floor(p.z() / size))};
}

// Occupied cells, numbered in their sorted order, and the cell of every point.
struct Grid {
  std::vector<Cell> cells;
  std::vector<int> cell_of_point;
};

Grid occupied_cells(const std::vector<Eigen::Vector3d>& points, double size) {
  Grid grid;
  std::vector<Cell> keys;
  keys.reserve(points.size());
  for (const Eigen::Vector3d& p : points) keys.push_back(cell_of(p, size));
  grid.cells = keys;
  std::sort(grid.cells.begin(), grid.cells.end());
  grid.cells.erase(std::unique(grid.cells.begin(), grid.cells.end()), grid.cells.end());
  grid.cell_of_point.reserve(points.size());
  for (const Cell& key : keys)
    grid.cell_of_point.push_back(
        static_cast<int>(std::lower_bound(grid.cells.begin(), grid.cells.end(), key) - grid.cells.begin()));
  return grid;
}

// Group of every cell; cells that touch, also by a corner, share one.
std::vector<int> connected_groups(const std::vector<Cell>& cells) {
  std::vector<int> group(cells.size(), -1);
  std::vector<int> open;
  int groups = 0;
  for (std::size_t start = 0; start < cells.size(); ++start) {
    if (group[start] >= 0) continue;
    open.push_back(static_cast<int>(start));
    group[start] = groups;
    while (!open.empty()) {
      const Cell c = cells[open.back()];
      open.pop_back();
      for (int n = 0; n < 27; ++n) {
        const Cell neighbour{c[0] + n % 3 - 1, c[1] + n / 3 % 3 - 1, c[2] + n / 9 - 1};
        const auto found = std::lower_bound(cells.begin(), cells.end(), neighbour);
        if (found == cells.end() || *found != neighbour) continue;
        const auto i = static_cast<std::size_t>(found - cells.begin());
        if (group[i] >= 0) continue;
        group[i] = groups;
        open.push_back(static_cast<int>(i));
      }
    }
    ++groups;
  }
  return group;
}

// How far a point can be relied on, in (0, 1]: its confidence, and less where its own deviation is large.
double evidence(const PointCloud& cloud, std::size_t i) {
  constexpr double least = 0.02, good = 0.004;  // metres
  double weight = 1.0;
  if (!cloud.confidence.empty()) weight = std::min(static_cast<double>(cloud.confidence[i]), 1.0);
  if (!cloud.deviation.empty()) {
    const double deviation = cloud.deviation[i];
    if (std::isfinite(deviation)) weight *= good * good / (good * good + deviation * deviation);
  }
  return weight > least ? weight : least;  // also when it is not a number
}

}  // namespace

Result<OrientedPoints> prepare_cloud(const PointCloud& cloud, const PreparationOptions& options) {
  if (cloud.points.empty())
    return fail("the cloud of the subject is empty", "", "look at the cloud stage: no surface was found in the images");
  if (cloud.normals.size() != cloud.points.size()) return fail("the cloud of the subject has no normals");
  OrientedPoints finite;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const Eigen::Vector3d p = cloud.points[i].cast<double>();
    Eigen::Vector3d n = cloud.normals[i].cast<double>();
    // A grid cell's number must fit an int; nobody is a kilometre tall.
    if (!p.allFinite() || p.norm() > 1000.0 || !n.allFinite() || !(n.norm() > 0.5)) continue;
    n.normalize();
    if (p.y() < options.floor_height && n.y() > 0.8) continue;
    finite.positions.push_back(p);
    finite.normals.push_back(n);
    finite.weights.push_back(evidence(cloud, i));
  }
  if (finite.positions.empty()) return fail("the cloud of the subject holds no usable point above the floor");

  const Grid grid = occupied_cells(finite.positions, options.cell);
  const std::vector<int> group = connected_groups(grid.cells);
  std::vector<int> size(*std::max_element(group.begin(), group.end()) + 1, 0);
  for (const int g : group) ++size[g];
  const double smallest = options.smallest_share * static_cast<double>(grid.cells.size());
  OrientedPoints kept;
  for (std::size_t i = 0; i < finite.size(); ++i) {
    if (size[group[grid.cell_of_point[i]]] < smallest) continue;
    kept.positions.push_back(finite.positions[i]);
    kept.normals.push_back(finite.normals[i]);
    kept.weights.push_back(finite.weights[i]);
  }
  return kept;
}

OrientedPoints thin(const OrientedPoints& points, double cell) {
  const Grid grid = occupied_cells(points.positions, cell);
  // Up to two representatives a cell, for the two sides of something thin.
  struct Sum {
    Eigen::Vector3d position = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero(), first_normal;
    double weight = 0.0;
    int count = 0;
    std::size_t first = 0;
  };
  std::vector<std::array<Sum, 2>> sums(grid.cells.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    auto& cell_sums = sums[grid.cell_of_point[i]];
    Sum& sum =
        cell_sums[0].count == 0 || cell_sums[0].first_normal.dot(points.normals[i]) > 0 ? cell_sums[0] : cell_sums[1];
    if (sum.count == 0) {
      sum.first_normal = points.normals[i];
      sum.first = i;
    }
    const double weight = points.weight(i);
    sum.position += weight * points.positions[i];
    sum.normal += weight * points.normals[i];
    sum.weight += weight;
    ++sum.count;
  }
  std::vector<const Sum*> ordered;
  for (const auto& cell_sums : sums)
    for (const Sum& sum : cell_sums)
      if (sum.count > 0 && sum.normal.norm() > 1e-6 * sum.weight) ordered.push_back(&sum);
  std::sort(ordered.begin(), ordered.end(), [](const Sum* a, const Sum* b) { return a->first < b->first; });
  OrientedPoints thinned;
  for (const Sum* sum : ordered) {
    thinned.positions.emplace_back(sum->position / sum->weight);
    thinned.normals.push_back(sum->normal.normalized());
    thinned.weights.push_back(sum->weight / sum->count);
  }
  return thinned;
}

double cell_for_count(const OrientedPoints& points, std::size_t count) {
  double cell = 0.02;
  // A surface's cells go with the square of the density; few rounds suffice.
  for (int round = 0; round < 6; ++round) {
    const double ratio = static_cast<double>(occupied_cells(points.positions, cell).cells.size()) / count;
    if (ratio > 0.9 && ratio < 1.1) break;
    cell = std::clamp(cell * std::sqrt(ratio), 0.001, 0.2);
  }
  return cell;
}

}  // namespace gyre
