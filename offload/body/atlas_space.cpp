// SPDX-License-Identifier: Apache-2.0
#include "offload/body/atlas_space.h"

namespace gyre {

AtlasSpace::AtlasSpace(int cells, int margin)
    : cells_(cells), margin_(margin), covered_(static_cast<std::size_t>(cells) * cells, 0) {}

void AtlasSpace::cover(const std::vector<Eigen::Vector2d>& uv, const std::vector<Eigen::Vector3i>& triangles) {
  for (const Eigen::Vector3i& t : triangles) {
    const Eigen::Vector2d a = uv[t[0]] * cells_, ab = uv[t[1]] * cells_ - a, ac = uv[t[2]] * cells_ - a;
    // Samples less than a cell apart leave no covered cell out.
    const int steps = 1 + static_cast<int>(2 * std::max(ab.norm(), ac.norm()));
    for (int i = 0; i <= steps; ++i)
      for (int j = 0; i + j <= steps; ++j) {
        const Eigen::Vector2d at = a + ab * i / steps + ac * j / steps;
        const int x = std::clamp(static_cast<int>(at.x()), 0, cells_ - 1);
        const int y = std::clamp(static_cast<int>(at.y()), 0, cells_ - 1);
        covered_[static_cast<std::size_t>(y) * cells_ + x] = 1;
      }
  }
}

std::optional<Eigen::Vector2d> AtlasSpace::take(const Eigen::Vector2d& size) {
  const int width = static_cast<int>(std::ceil(size.x() * cells_)),
            height = static_cast<int>(std::ceil(size.y() * cells_));
  const std::size_t stride = static_cast<std::size_t>(cells_) + 1;
  std::vector<int> sum(stride * stride, 0);  // covered cells above and left of a corner
  for (int y = 0; y < cells_; ++y)
    for (int x = 0; x < cells_; ++x)
      sum[(y + 1) * stride + x + 1] = covered_[static_cast<std::size_t>(y) * cells_ + x] + sum[y * stride + x + 1] +
                                      sum[(y + 1) * stride + x] - sum[y * stride + x];
  for (int y = margin_; y + height + margin_ <= cells_; ++y)
    for (int x = margin_; x + width + margin_ <= cells_; ++x) {
      const int left = x - margin_, top = y - margin_, right = x + width + margin_, bottom = y + height + margin_;
      if (sum[bottom * stride + right] - sum[top * stride + right] - sum[bottom * stride + left] +
          sum[top * stride + left])
        continue;
      for (int row = y; row < y + height; ++row)
        std::fill_n(covered_.begin() + static_cast<std::ptrdiff_t>(row) * cells_ + x, width, std::uint8_t{1});
      return Eigen::Vector2d(x, y) / cells_;
    }
  return std::nullopt;
}

}  // namespace gyre
