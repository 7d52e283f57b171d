// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/atlas.h"

#include <algorithm>
#include <cmath>

namespace gyre {

namespace {

// A texture triangle in texel units, ready to give barycentric weights.
class TexelTriangle {
 public:
  TexelTriangle(std::span<const Eigen::Vector2d> uv, const Eigen::Vector3i& corners, int size) {
    for (int k = 0; k < 3; ++k) corner_[k] = uv[corners[k]] * size;
    const Eigen::Vector2d e1 = corner_[1] - corner_[0];
    const Eigen::Vector2d e2 = corner_[2] - corner_[0];
    area_ = e1.x() * e2.y() - e1.y() * e2.x();
  }

  bool degenerate() const { return std::abs(area_) < 1e-12; }

  // Weights of corners 1 and 2 at the centre of texel (x, y).
  Eigen::Vector2d weights(int x, int y) const {
    const Eigen::Vector2d p = Eigen::Vector2d(x + 0.5, y + 0.5) - corner_[0];
    const Eigen::Vector2d e1 = corner_[1] - corner_[0];
    const Eigen::Vector2d e2 = corner_[2] - corner_[0];
    return {(p.x() * e2.y() - p.y() * e2.x()) / area_, (e1.x() * p.y() - e1.y() * p.x()) / area_};
  }

  Eigen::Vector2d low() const { return corner_[0].cwiseMin(corner_[1]).cwiseMin(corner_[2]); }
  Eigen::Vector2d high() const { return corner_[0].cwiseMax(corner_[1]).cwiseMax(corner_[2]); }

 private:
  Eigen::Vector2d corner_[3];
  double area_ = 0.0;
};

// How far outside its triangle a point with these weights lies (0: inside).
double outside(const Eigen::Vector2d& w) {
  return std::max({0.0, -w.x(), -w.y(), w.x() + w.y() - 1.0});
}

void grow(Atlas& atlas, std::span<const Eigen::Vector2d> uv, std::span<const Eigen::Vector3i> uv_triangles) {
  const std::vector<std::int32_t> before = atlas.triangle;
  const int size = atlas.size;
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * size + x;
      if (before[i] >= 0) continue;
      double best = std::numeric_limits<double>::infinity();
      for (int v = std::max(0, y - 1); v <= std::min(size - 1, y + 1); ++v) {
        for (int u = std::max(0, x - 1); u <= std::min(size - 1, x + 1); ++u) {
          const std::int32_t t = before[static_cast<std::size_t>(v) * size + u];
          if (t < 0) continue;
          const Eigen::Vector2d w = TexelTriangle(uv, uv_triangles[t], size).weights(x, y);
          if (outside(w) >= best) continue;
          best = outside(w);
          atlas.triangle[i] = t;
          // Thin triangles would carry the point far away along their plane.
          atlas.weights[i] = w.cwiseMax(-1.0).cwiseMin(2.0).cast<float>();
        }
      }
    }
  }
}

}  // namespace

Atlas map_atlas(std::span<const Eigen::Vector2d> uv, std::span<const Eigen::Vector3i> uv_triangles, int size, int rim) {
  Atlas atlas;
  atlas.size = size;
  atlas.triangle.assign(static_cast<std::size_t>(size) * size, -1);
  atlas.weights.assign(atlas.triangle.size(), Eigen::Vector2f::Zero());
  for (std::size_t t = 0; t < uv_triangles.size(); ++t) {
    const TexelTriangle triangle(uv, uv_triangles[t], size);
    if (triangle.degenerate()) continue;
    const Eigen::Vector2i low = (triangle.low().array() - 0.5).ceil().cast<int>().max(0).matrix();
    const Eigen::Vector2i high = (triangle.high().array() - 0.5).floor().cast<int>().min(size - 1).matrix();
    for (int y = low.y(); y <= high.y(); ++y) {
      for (int x = low.x(); x <= high.x(); ++x) {
        const std::size_t i = static_cast<std::size_t>(y) * size + x;
        if (atlas.triangle[i] >= 0) continue;
        const Eigen::Vector2d w = triangle.weights(x, y);
        if (outside(w) > 0) continue;
        atlas.triangle[i] = static_cast<std::int32_t>(t);
        atlas.weights[i] = w.cast<float>();
      }
    }
  }
  for (int k = 0; k < rim; ++k) grow(atlas, uv, uv_triangles);
  return atlas;
}

}  // namespace gyre
