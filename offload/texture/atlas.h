// SPDX-License-Identifier: Apache-2.0
// Which point of the surface each texel of a texture shows.
#pragma once

#include "common/mesh/mesh.h"

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

namespace gyre {

// A square texture, row major, first row at v = 0.
struct Atlas {
  int size = 0;
  std::vector<std::int32_t> triangle;    // -1: no surface
  std::vector<Eigen::Vector2f> weights;  // barycentric weights of corners 1 and 2; outside [0, 1] on the rim

  std::size_t texels() const { return triangle.size(); }
};

// Scan-converts the texture triangles (uv in [0, 1], any winding). Where charts overlap, the triangle that comes first
// keeps the texel. Then every chart grows by `rim` texels that continue its border triangle's plane, so that bilinear
// lookups at a seam see the surface and not the gap. uv_triangles: three indices into uv a triangle.
Atlas map_atlas(std::span<const Eigen::Vector2d> uv, std::span<const Eigen::Vector3i> uv_triangles, int size, int rim);

// Corner weights of texel i.
inline Eigen::Vector3d corner_weights(const Atlas& atlas, std::size_t i) {
  const Eigen::Vector2d w = atlas.weights[i].cast<double>();
  return {1.0 - w.x() - w.y(), w.x(), w.y()};
}

// Where texel i lies: metres, world.
inline Eigen::Vector3d texel_point(const TriangleMesh& mesh, const Atlas& atlas, std::size_t i) {
  const Eigen::Vector3d weights = corner_weights(atlas, i);
  const Eigen::Vector3i& corners = mesh.triangles[atlas.triangle[i]];
  return weights[0] * mesh.vertices[corners[0]] + weights[1] * mesh.vertices[corners[1]] +
         weights[2] * mesh.vertices[corners[2]];
}

}  // namespace gyre
