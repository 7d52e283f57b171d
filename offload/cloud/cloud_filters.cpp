// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/cloud_filters.h"

#include "offload/cloud/cell_grid.h"

#include <algorithm>
#include <cmath>

namespace gyre {

PointCloud selected(const PointCloud& cloud, const std::vector<char>& keep) {
  PointCloud kept;
  for (std::size_t i = 0; i < keep.size(); ++i) {
    if (keep[i] == 0) continue;
    kept.points.push_back(cloud.points[i]);
    kept.normals.push_back(cloud.normals[i]);
    kept.colours.push_back(cloud.colours[i]);
    kept.confidence.push_back(cloud.confidence[i]);
    kept.deviation.push_back(cloud.deviation[i]);
  }
  return kept;
}

std::vector<char> above_floor(const PointCloud& cloud, const FloorOptions& options) {
  std::vector<char> keep(cloud.points.size());
  for (std::size_t i = 0; i < keep.size(); ++i)
    keep[i] = is_floor(cloud.points[i].y(), cloud.normals[i].y(), options) ? 0 : 1;
  return keep;
}

std::vector<char> well_surrounded(const PointCloud& cloud, double radius, int count) {
  const CellGrid grid(cloud.points, radius);
  const auto squared = static_cast<float>(radius * radius);
  std::vector<char> keep(cloud.points.size(), 0);
  for (std::size_t i = 0; i < keep.size(); ++i) {
    const Eigen::Vector3f& x = cloud.points[i];
    int around = -1;  // the point finds itself
    for_neighbour_cells(grid.cell_of(x), [&](const Cell& cell) {
      const std::ptrdiff_t found = around < count ? grid.find(cell) : -1;
      if (found < 0) return;
      grid.for_points(static_cast<std::size_t>(found),
                      [&](std::uint32_t j) { around += (cloud.points[j] - x).squaredNorm() <= squared ? 1 : 0; });
    });
    keep[i] = around >= count ? 1 : 0;
  }
  return keep;
}

std::vector<char> subject_clusters(const PointCloud& cloud, const SubjectRegion& region,
                                   const ClusterOptions& options) {
  const CellGrid grid(cloud.points, options.gap);
  constexpr std::int32_t unlabelled = -1;
  std::vector<std::int32_t> label(grid.cell_count(), unlabelled);
  std::vector<double> mass;
  const Eigen::Vector3d centre = region.centre();
  const double radius = 0.5 * std::max(region.max.x() - region.min.x(), region.max.z() - region.min.z());
  std::vector<std::size_t> open;
  for (std::size_t seed = 0; seed < grid.cell_count(); ++seed) {
    if (label[seed] != unlabelled) continue;
    const auto name = static_cast<std::int32_t>(mass.size());
    mass.push_back(0.0);
    label[seed] = name;
    open.assign(1, seed);
    while (!open.empty()) {
      const std::size_t cell = open.back();
      open.pop_back();
      const Cell at = grid.cell_of(cloud.points[grid.first_point(cell)]);
      grid.for_points(cell, [&](std::uint32_t i) {
        const Eigen::Vector3f& x = cloud.points[i];
        mass[name] += std::max(0.05, 1.0 - std::hypot(x.x() - centre.x(), x.z() - centre.z()) / radius);
      });
      for_neighbour_cells(at, [&](const Cell& next) {
        const std::ptrdiff_t found = grid.find(next);
        if (found < 0 || label[found] != unlabelled) return;
        label[found] = name;
        open.push_back(static_cast<std::size_t>(found));
      });
    }
  }
  const double largest = mass.empty() ? 0.0 : *std::max_element(mass.begin(), mass.end());
  std::vector<char> keep(cloud.points.size(), 0);
  for (std::size_t cell = 0; cell < grid.cell_count(); ++cell) {
    const bool kept = mass[label[cell]] >= options.min_share * largest;
    grid.for_points(cell, [&](std::uint32_t i) { keep[i] = kept ? 1 : 0; });
  }
  return keep;
}

}  // namespace gyre
