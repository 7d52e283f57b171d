// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/relief.h"

#include <algorithm>
#include <limits>

namespace gyre {

namespace {

// Weighted sums along one axis with a Gaussian of `sigma` cells.
void blur(std::vector<double>& values, int columns, int rows, bool along_rows, double sigma) {
  const int radius = static_cast<int>(std::ceil(3 * sigma));
  std::vector<double> kernel;
  for (int k = -radius; k <= radius; ++k) kernel.push_back(std::exp(-0.5 * k * k / (sigma * sigma)));
  std::vector<double> result(values.size(), 0.0);
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) {
      double sum = 0;
      for (int k = -radius; k <= radius; ++k) {
        const int column = along_rows ? c + k : c, row = along_rows ? r : r + k;
        if (column < 0 || row < 0 || column >= columns || row >= rows) continue;
        sum += kernel[k + radius] * values[static_cast<std::size_t>(row) * columns + column];
      }
      result[static_cast<std::size_t>(r) * columns + c] = sum;
    }
  values.swap(result);
}

}  // namespace

double Relief::at(const Eigen::Vector2d& place) const {
  const Eigen::Vector2d at = (place - low) / cell - Eigen::Vector2d(0.5, 0.5);
  const int c = static_cast<int>(std::floor(at.x())), r = static_cast<int>(std::floor(at.y()));
  if (!inside(c, r) || !inside(c + 1, r + 1)) return std::numeric_limits<double>::quiet_NaN();
  const double u = at.x() - c, v = at.y() - r;
  return (1 - v) * ((1 - u) * height[index(c, r)] + u * height[index(c + 1, r)]) +
         v * ((1 - u) * height[index(c, r + 1)] + u * height[index(c + 1, r + 1)]);
}

Relief make_relief(std::span<const Eigen::Vector3d> points, const Eigen::Isometry3d& world_from_relief,
                   const ReliefOptions& options) {
  Relief relief;
  relief.world_from_relief = world_from_relief;
  relief.cell = options.cell;
  relief.low = options.low;
  const Eigen::Vector2d size = (options.high - options.low) / options.cell;
  relief.columns = static_cast<int>(std::ceil(size.x()));
  relief.rows = static_cast<int>(std::ceil(size.y()));
  const std::size_t cells = static_cast<std::size_t>(relief.columns) * relief.rows;

  const Eigen::Isometry3d relief_from_world = world_from_relief.inverse();
  std::vector<std::pair<std::size_t, double>> entries;
  std::vector<double> foremost(cells, -std::numeric_limits<double>::infinity());
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3d p = relief_from_world * point;
    const Eigen::Vector2d at = (p.head<2>() - options.low) / options.cell;
    const int c = static_cast<int>(std::floor(at.x())), r = static_cast<int>(std::floor(at.y()));
    if (!relief.inside(c, r)) continue;
    entries.emplace_back(relief.index(c, r), p.z());
  }
  // A cell's foremost surface is that of its neighbourhood, so that a thin cell does not show what lies behind.
  for (const auto& [cell, z] : entries) {
    const int c = static_cast<int>(cell % relief.columns), r = static_cast<int>(cell / relief.columns);
    for (int dr = -1; dr <= 1; ++dr)
      for (int dc = -1; dc <= 1; ++dc)
        if (relief.inside(c + dc, r + dr)) {
          double& front = foremost[relief.index(c + dc, r + dr)];
          front = std::max(front, z);
        }
  }
  std::vector<double> sum(cells, 0.0), weight(cells, 0.0);
  for (const auto& [cell, z] : entries) {
    if (z < foremost[cell] - options.depth) continue;
    sum[cell] += z;
    weight[cell] += 1;
  }
  // Every measured cell counts alike however many points it has, up to a few.
  for (std::size_t i = 0; i < cells; ++i)
    if (weight[i] > 4) {
      sum[i] *= 4 / weight[i];
      weight[i] = 4;
    }
  const auto blurred = [&](double sigma) {
    std::vector<double> s = sum, w = weight;
    for (const bool along_rows : {true, false}) {
      blur(s, relief.columns, relief.rows, along_rows, sigma / options.cell);
      blur(w, relief.columns, relief.rows, along_rows, sigma / options.cell);
    }
    return std::pair{s, w};
  };
  const auto [fine, fine_weight] = blurred(options.smooth);
  const auto [wide, wide_weight] = blurred(options.fill / 2);
  relief.height.assign(cells, std::numeric_limits<float>::quiet_NaN());
  relief.deviation.assign(cells, 0.0F);
  for (std::size_t i = 0; i < cells; ++i) {
    if (fine_weight[i] > 0.3) {
      relief.height[i] = static_cast<float>(fine[i] / fine_weight[i]);
    } else if (wide_weight[i] > 0.3) {
      relief.height[i] = static_cast<float>(wide[i] / wide_weight[i]);
      relief.deviation[i] = static_cast<float>(0.25 * options.fill);
    }
  }
  return relief;
}

}  // namespace gyre
