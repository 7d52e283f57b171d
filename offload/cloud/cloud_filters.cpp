// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/cloud_filters.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <utility>

namespace gyre {
namespace {

using Cell = Eigen::Matrix<std::int32_t, 3, 1>;

// Points sorted into cubes, found again by binary search: deterministic and without a hash table's order.
class CellGrid {
 public:
  CellGrid(const std::vector<Eigen::Vector3f>& points, double size) : size_(size) {
    order_.reserve(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      order_.emplace_back(key(cell_of(points[i])), static_cast<std::uint32_t>(i));
    }
    std::sort(order_.begin(), order_.end());
    for (std::size_t i = 0; i < order_.size(); ++i) {
      if (i == 0 || order_[i].first != order_[i - 1].first) starts_.push_back(static_cast<std::uint32_t>(i));
    }
    starts_.push_back(static_cast<std::uint32_t>(order_.size()));
  }

  Cell cell_of(const Eigen::Vector3f& x) const {
    return Cell(static_cast<std::int32_t>(std::floor(x.x() / size_)),
                static_cast<std::int32_t>(std::floor(x.y() / size_)),
                static_cast<std::int32_t>(std::floor(x.z() / size_)));
  }
  std::size_t cell_count() const { return starts_.size() - 1; }

  // Index of a cell, or -1.
  std::ptrdiff_t find(const Cell& cell) const {
    const std::uint64_t wanted = key(cell);
    const auto it = std::lower_bound(starts_.begin(), starts_.end() - 1, wanted,
                                     [&](std::uint32_t start, std::uint64_t k) { return order_[start].first < k; });
    if (it == starts_.end() - 1 || order_[*it].first != wanted) return -1;
    return it - starts_.begin();
  }

  std::uint32_t first_point(std::size_t cell) const { return order_[starts_[cell]].second; }

  template <class Visit>
  void for_points(std::size_t cell, const Visit& visit) const {
    for (std::uint32_t i = starts_[cell]; i < starts_[cell + 1]; ++i) visit(order_[i].second);
  }

 private:
  static std::uint64_t key(const Cell& cell) {
    std::uint64_t k = 0;
    for (int axis = 0; axis < 3; ++axis)
      k = k << 21U | (static_cast<std::uint64_t>(cell[axis] + (1 << 20)) & 0x1FFFFFU);
    return k;
  }

  double size_;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order_;
  std::vector<std::uint32_t> starts_;
};

template <class Visit>
void for_neighbour_cells(const Cell& centre, const Visit& visit) {
  for (int n = 0; n < 27; ++n) visit(Cell(centre + Cell(n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1)));
}

}  // namespace

PointCloud selected(const PointCloud& cloud, const std::vector<char>& keep) {
  PointCloud kept;
  for (std::size_t i = 0; i < keep.size(); ++i) {
    if (keep[i] == 0) continue;
    kept.points.push_back(cloud.points[i]);
    kept.normals.push_back(cloud.normals[i]);
    kept.colours.push_back(cloud.colours[i]);
    kept.confidence.push_back(cloud.confidence[i]);
  }
  return kept;
}

std::vector<char> above_floor(const PointCloud& cloud, const FloorOptions& options) {
  const auto upright = static_cast<float>(std::cos(options.max_angle_deg * std::numbers::pi / 180.0));
  std::vector<char> keep(cloud.points.size());
  for (std::size_t i = 0; i < keep.size(); ++i) {
    const float y = cloud.points[i].y();
    const bool floor = y < options.certain_height || (y < options.height && cloud.normals[i].y() > upright);
    keep[i] = floor ? 0 : 1;
  }
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
