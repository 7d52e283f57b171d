// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/point_grid.h"

#include <algorithm>

namespace gyre {

namespace {

// Cells along z follow each other, so that a row of them is one range.
std::uint64_t key(int x, int y, int z) {
  const auto part = [](int value) { return static_cast<std::uint64_t>(value + (1 << 20)) & 0x1FFFFFU; };
  return part(x) << 42U | part(y) << 21U | part(z);
}

}  // namespace

PointGrid::PointGrid(std::span<const Eigen::Vector3d> points, double cell) : points_(points), cell_(cell) {
  order_.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3i c = cell_of(points[i].array());
    order_.emplace_back(key(c.x(), c.y(), c.z()), static_cast<std::uint32_t>(i));
  }
  std::sort(order_.begin(), order_.end());
}

std::pair<std::uint32_t, std::uint32_t> PointGrid::row(int x, int y, int low, int high) const {
  const auto first = std::lower_bound(order_.begin(), order_.end(), std::pair{key(x, y, low), std::uint32_t{0}});
  auto last = first;
  const std::uint64_t end = key(x, y, high);
  while (last != order_.end() && last->first <= end) ++last;
  return {static_cast<std::uint32_t>(first - order_.begin()), static_cast<std::uint32_t>(last - order_.begin())};
}

int PointGrid::nearest(const Eigen::Vector3d& place, double radius) const {
  int best = -1;
  double least = 0;
  for_within(place, radius, [&](std::uint32_t index, double squared) {
    if (best >= 0 && squared >= least) return;
    best = static_cast<int>(index);
    least = squared;
  });
  return best;
}

}  // namespace gyre
