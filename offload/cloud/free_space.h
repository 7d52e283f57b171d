// SPDX-License-Identifier: Apache-2.0
// What the depth maps say about points of space: seen, hidden, or looked straight through.
#pragma once

#include "common/mesh/mesh.h"
#include "offload/cloud/stereo_depth.h"
#include "offload/cloud/stereo_view.h"

#include <cstdint>
#include <span>
#include <vector>

namespace gyre {

struct FreeSpaceOptions {
  double agreement = 0.004;  // share of the depth within which a view's surface agrees with a point
  double clearance = 0.006;  // share of the depth behind a point at which a view's surface speaks against it
  double min_facing = 0.2;   // cosine between the normal and the direction to a view that may vote
  float max_cost = 0.5F;     // matching cost of a pixel whose vote counts
};

// 0 for points that more views speak against than agree with, over all views; the others 1. The points that dense
// stereo draws from a silhouette onto the background beside it agree with the views next to the one they came from, and
// are seen through from the side (free-space votes of Merrell et al., ICCV 2007).
std::vector<char> outside_free_space(const PointCloud& cloud, std::span<const StereoView> views,
                                     std::span<const StereoDepth> maps, const FreeSpaceOptions& options, int threads);

// The views that see each point of a cloud.
struct PointViews {
  std::vector<std::uint32_t> first{0};  // one more than points: point i has view[first[i]] to view[first[i + 1] - 1]
  std::vector<std::uint16_t> view;      // indices, ascending

  std::span<const std::uint16_t> of(std::size_t point) const {
    return std::span(view).subspan(first[point], first[point + 1] - first[point]);
  }
};

// Those whose vote on the point agrees.
PointViews views_that_see(const PointCloud& cloud, std::span<const StereoView> views, std::span<const StereoDepth> maps,
                          const FreeSpaceOptions& options, int threads);

// How many views look through a point of space, and for how many something stands at it or before it.
struct SightCount {
  int through = 0;
  int blocked = 0;
};
SightCount count_sight(const Eigen::Vector3d& point, std::span<const StereoView> views,
                       std::span<const StereoDepth> maps, const FreeSpaceOptions& options);

}  // namespace gyre
