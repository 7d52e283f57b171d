// SPDX-License-Identifier: Apache-2.0
// Which photographs see which triangle, how well, and in what colour.
#pragma once

#include "common/mesh/mesh.h"
#include "offload/texture/depth_map.h"
#include "offload/texture/photo.h"

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

namespace gyre {

// Limits for using a photograph on a piece of surface. A view within `strict` always beats one that is only `loose`.
struct ViewLimits {
  double strict_cosine = 0.70710678;  // 45 degrees between normal and view
  double loose_cosine = 0.25881905;   // 75 degrees
  double strict_edge = 0.006;         // metres on the surface to the nearest depth edge in the picture
  double loose_edge_px = 3.0;         // the blur of a silhouette, and the footprint of a bilinear sample
};

enum class ViewQuality : std::uint8_t { none, loose, strict };

ViewQuality quality_of(const Sight& sight, const ViewLimits& limits);

// A surface, the photographs of it, and what counts as seeing it.
struct PhotographedSurface {
  const TriangleMesh& mesh;
  std::span<const Eigen::Vector3d> normals;  // one a triangle, unit
  std::span<const Photo> photos;
  std::span<const DepthMap> depths;  // one a photograph
  SightOptions sight;
  ViewLimits limits;

  // Sight of a point in a photograph when it passes the loose limits at least.
  struct Look {
    ViewQuality quality = ViewQuality::none;
    Sight sight;
  };
  Look look(int photo, const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const;
};

// One triangle in one photograph. The whole triangle passes the limits.
struct Observation {
  int photo = 0;
  ViewQuality quality = ViewQuality::none;
  float score = 0;         // cosine times resolution (pixels per metre), damped near depth edges
  float detail = 0;        // log of the local Laplacian energy
  Eigen::Vector3f colour;  // mean encoded BGR, in the photo's own exposure
};

// Observations of every triangle, in the order of the photographs.
struct ObservationTable {
  std::vector<std::size_t> start;  // triangles + 1
  std::vector<Observation> all;

  std::span<const Observation> of(std::size_t triangle) const {
    return {all.data() + start[triangle], start[triangle + 1] - start[triangle]};
  }
  std::span<Observation> of(std::size_t triangle) {
    return {all.data() + start[triangle], start[triangle + 1] - start[triangle]};
  }
};

// skip: triangles that need no photograph (1), one a triangle.
ObservationTable observe(const PhotographedSurface& surface, std::span<const std::uint8_t> skip, int threads);

}  // namespace gyre
