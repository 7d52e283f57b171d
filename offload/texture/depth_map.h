// SPDX-License-Identifier: Apache-2.0
// What a photograph can see of the surface: depth test, view angle and distance to the nearest depth edge.
#pragma once

#include "common/mesh/mesh.h"
#include "offload/texture/photo.h"

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

namespace gyre {

struct DepthMap {
  int width = 0;
  int height = 0;
  std::vector<float> depth;                 // metres along z; infinity: background
  std::vector<std::uint8_t> edge_distance;  // pixels to the nearest depth edge or background, at most 255
};

struct SightOptions {
  double edge_jump = 0.015;     // metres between neighbouring pixels that make a depth edge
  double depth_margin = 0.003;  // metres the depth test forgives on a surface seen head-on
  double slope_margin = 1.5;    // and pixels' worth of depth slope on top of it
};

// Rasterises the whole surface, back faces too: an open shell hides what lies behind it from both sides.
DepthMap map_depth(const TriangleMesh& mesh, const Photo& photo, const SightOptions& options);

// Takes over the edges of another map of the same picture: a pixel is as near to an edge as either map says.
void add_edges(DepthMap& map, const DepthMap& other);

// A surface point in a photograph that sees it.
struct Sight {
  Eigen::Vector2d pixel;
  double cosine = 0.0;         // between the normal and the direction to the camera
  double edge_distance = 0.0;  // pixels
  double pixels_per_metre = 0.0;
};

// Nothing when the point is behind the camera, outside the picture, turned away, or hidden behind the depth map by more
// than the margin, which grows with the depth slope of the surface over a pixel. normal: unit, world.
std::optional<Sight> see(const Photo& photo, const DepthMap& map, const Eigen::Vector3d& point,
                         const Eigen::Vector3d& normal, const SightOptions& options);

}  // namespace gyre
