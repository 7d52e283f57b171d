// SPDX-License-Identifier: Apache-2.0
// Free space in a texture atlas.
#pragma once

#include "common/mesh/mesh.h"

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace gyre {

// Which cells of a square atlas are covered, and where a rectangle still fits.
class AtlasSpace {
 public:
  // `margin`: cells kept free around everything, so that filtering and mipmaps do not mix charts.
  explicit AtlasSpace(int cells = 512, int margin = 3);

  // Covers the triangles of texture coordinates in [0, 1].
  void cover(const std::vector<Eigen::Vector2d>& uv, const std::vector<Eigen::Vector3i>& triangles);

  // Top left corner of the first free rectangle of that size (fractions of the atlas) in reading order, which is then
  // covered; nothing when there is none.
  std::optional<Eigen::Vector2d> take(const Eigen::Vector2d& size);

 private:
  int cells_, margin_;
  std::vector<std::uint8_t> covered_;
};

}  // namespace gyre
