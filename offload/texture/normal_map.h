// SPDX-License-Identifier: Apache-2.0
// The relief of the cloud that the fitted mesh is too coarse to have, as a normal map.
#pragma once

#include "common/mesh/mesh.h"

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <span>

namespace gyre {

struct NormalMapOptions {
  int size = 2048;            // texels a side
  double reach = 0.008;       // metres around a texel that its normal is fitted over
  double most_offset = 0.02;  // metres between the surface and points that belong to it
  double slope = 0.3;         // standard deviation of the relief's slope against the mesh
  double alike = 8.0;         // neighbouring points err together: this many count as one
  double deviation = 0.002;   // metres, of points whose deviation the cloud does not say
};

struct NormalMap {
  cv::Mat picture;       // 8-bit BGR; in the frames of corner_tangents, x in red, y in green, z in blue, 128 is zero
  double covered = 0.0;  // share of the surface's texels that points lie around
};

// At every texel, the plane through the points around it (moving least squares, weighed by their deviation, the
// distance and how well they agree), held to the mesh's own smooth normal by a prior on its slope, so that what the
// cloud does not say stays flat. Points count for the texels around their foot on the mesh. mesh: posed as the cloud,
// metres, with texture coordinates. skip: triangles that stay flat (1), one a triangle.
NormalMap bake_normal_map(const TriangleMesh& mesh, const PointCloud& cloud, std::span<const std::uint8_t> skip,
                          const NormalMapOptions& options, int threads);

}  // namespace gyre
