// SPDX-License-Identifier: Apache-2.0
// Points sorted into cubes, to find those near a place.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace gyre {

class PointGrid {
 public:
  // Keeps a view of the points; `cell` is the side of the cubes in metres.
  PointGrid(std::span<const Eigen::Vector3d> points, double cell);

  // Calls visit(index, squared distance) for every point no farther than `radius` from the place, in an order that
  // depends on the points alone.
  template <class Visit>
  void for_within(const Eigen::Vector3d& place, double radius, const Visit& visit) const {
    const Eigen::Vector3i low = cell_of(place.array() - radius), high = cell_of(place.array() + radius);
    for (int x = low.x(); x <= high.x(); ++x)
      for (int y = low.y(); y <= high.y(); ++y) {
        const auto [first, last] = row(x, y, low.z(), high.z());
        for (std::uint32_t i = first; i < last; ++i) {
          const std::uint32_t index = order_[i].second;
          const double squared = (points_[index] - place).squaredNorm();
          if (squared <= radius * radius) visit(index, squared);
        }
      }
  }

  // The nearest point no farther than `radius`; -1: none.
  int nearest(const Eigen::Vector3d& place, double radius) const;

 private:
  Eigen::Vector3i cell_of(const Eigen::Array3d& place) const { return (place / cell_).floor().cast<int>(); }
  // The points of the cells (x, y, z) with z in [low, high], as a range of order_.
  std::pair<std::uint32_t, std::uint32_t> row(int x, int y, int low, int high) const;

  std::span<const Eigen::Vector3d> points_;
  double cell_;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order_;  // key of the cell, point
};

}  // namespace gyre
