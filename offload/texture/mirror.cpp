// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/mirror.h"

#include "offload/texture/insertion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace gyre {

namespace {

bool is_seen(const Canvas& canvas, std::size_t texel) {
  return canvas.photo[texel] >= 0;
}

// The triangle that mirrors each one, -1: none.
std::vector<int> mirror_triangles(const TriangleMesh& mesh, std::span<const int> mirror) {
  const auto sorted = [](std::array<int, 3> corners) {
    std::sort(corners.begin(), corners.end());
    return corners;
  };
  std::map<std::array<int, 3>, int> by_corners;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Eigen::Vector3i& c = mesh.triangles[t];
    by_corners[sorted({c[0], c[1], c[2]})] = static_cast<int>(t);
  }
  std::vector<int> other;
  other.reserve(mesh.triangles.size());
  for (const Eigen::Vector3i& c : mesh.triangles) {
    const auto found = by_corners.find(sorted({mirror[c[0]], mirror[c[1]], mirror[c[2]]}));
    other.push_back(found == by_corners.end() ? -1 : found->second);
  }
  return other;
}

// Where the mirror image of a texel lies in the texture, in texels.
Eigen::Vector2d mirrored_place(const TriangleMesh& mesh, const Atlas& atlas, std::span<const int> mirror,
                               std::size_t texel, int other) {
  const Eigen::Vector3d weights = corner_weights(atlas, texel);
  Eigen::Vector2d place = Eigen::Vector2d::Zero();
  for (int k = 0; k < 3; ++k) {
    const int vertex = mirror[mesh.triangles[atlas.triangle[texel]][k]];
    for (int j = 0; j < 3; ++j) {
      if (mesh.triangles[other][j] == vertex) place += weights[k] * mesh.uv[mesh.uv_triangles[other][j]];
    }
  }
  return place * atlas.size;
}

struct Copy {
  std::size_t texel = 0;
  Eigen::Vector3f colour;
  std::uint8_t confidence = 0;
};

// Bilinear colour of four texels that were all seen; fails otherwise.
bool copy_from(const Canvas& canvas, int size, const Eigen::Vector2d& place, Copy& copy) {
  const Eigen::Vector2d p = place.array() - 0.5;
  const auto x = static_cast<int>(std::floor(p.x()));
  const auto y = static_cast<int>(std::floor(p.y()));
  if (x < 0 || y < 0 || x + 1 >= size || y + 1 >= size) return false;
  copy.colour.setZero();
  copy.confidence = 255;
  for (const int dy : {0, 1}) {
    for (const int dx : {0, 1}) {
      const std::size_t i = static_cast<std::size_t>(y + dy) * size + x + dx;
      if (!is_seen(canvas, i)) return false;
      const double weight = (dx == 1 ? p.x() - x : x + 1 - p.x()) * (dy == 1 ? p.y() - y : y + 1 - p.y());
      copy.colour += static_cast<float>(weight) * canvas.colour[i];
      copy.confidence = std::min(copy.confidence, canvas.confidence[i]);
    }
  }
  return true;
}

}  // namespace

void fill_mirrored(const TriangleMesh& mesh, const Atlas& atlas, std::span<const SharedEdge> edges,
                   std::span<const int> mirror, std::span<const std::uint8_t> skip, int threads, Canvas& canvas) {
  const std::vector<int> other = mirror_triangles(mesh, mirror);
  std::vector<Copy> copies;
  for (std::size_t i = 0; i < atlas.texels(); ++i) {
    const int t = atlas.triangle[i];
    if (t < 0 || skip[t] || other[t] < 0 || canvas.origin[i] != TexelOrigin::none) continue;
    Copy copy{.texel = i};
    if (copy_from(canvas, atlas.size, mirrored_place(mesh, atlas, mirror, i, other[t]), copy)) copies.push_back(copy);
  }
  std::vector<std::uint8_t> inserted(atlas.texels(), 0);
  for (const Copy& copy : copies) {
    inserted[copy.texel] = 1;
    canvas.colour[copy.texel] = copy.colour;
    canvas.origin[copy.texel] = TexelOrigin::mirrored;
    canvas.confidence[copy.texel] = copy.confidence / 2;
  }

  insert_texels(mesh, atlas, edges, inserted, 0.0, threads, canvas);
}

}  // namespace gyre
