// SPDX-License-Identifier: Apache-2.0
// Points that other views look straight through.
#pragma once

#include "common/mesh/mesh.h"
#include "offload/cloud/patch_match.h"
#include "offload/cloud/stereo_view.h"

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

}  // namespace gyre
