// SPDX-License-Identifier: Apache-2.0
// Points sorted into cubes, to find those near a place.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace gyre {

using Cell = Eigen::Matrix<std::int32_t, 3, 1>;

// Cubes of `size` metres, found again by binary search: deterministic and without a hash table's order.
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

}  // namespace gyre
