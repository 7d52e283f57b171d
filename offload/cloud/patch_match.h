// SPDX-License-Identifier: Apache-2.0
// Depth and normal of every pixel of a view by PatchMatch over slanted planes.
#pragma once

#include "offload/cloud/plane_cost.h"
#include "offload/cloud/stereo_depth.h"
#include "offload/cloud/stereo_view.h"
#include "offload/cloud/subject_region.h"

#include <cstdint>
#include <span>
#include <vector>

namespace gyre {

struct PatchMatchOptions {
  int coarse_iterations = 5;      // at the smallest level, from random planes
  int fine_iterations = 2;        // at each larger one, from the level below
  float background_reach = 3.0F;  // planes are sought this many times as far as the box's far end, so that background
                                  // finds its own depth instead of a wrong one inside the box
  float keep_cost = 0.75F;        // a coarse pixel worse than this is not followed to the larger level
  float beyond_cost = 0.5F;       // and one outside the region is remembered as beyond when it is better than this
  PlaneCostOptions judging;
  FloorOptions floor;
};

// Photometric estimate for views[reference] against `neighbours`: coarse to fine, red-black propagation from eight
// regions (Galliani et al., ICCV 2015, section 3; Xu and Tao, CVPR 2019, section 3.1) and random refinement whose
// numbers depend only on the seed and the pixel. Only pixels whose ray meets the region are looked at, and at the
// larger levels only those at or near a match in the region that is not floor.
StereoDepth estimate_depth(std::span<const StereoView> views, int reference, std::span<const int> neighbours,
                           const SubjectRegion& region, const PatchMatchOptions& options, std::uint64_t seed);

// One more pass from `map`, the estimate for views[reference], with the forward-backward reprojection error against the
// neighbours' `depths` added to the matching cost. `depths`: of all views, as estimated; an empty one is not known.
StereoDepth refine_depth(std::span<const StereoView> views, std::span<const std::vector<float>> depths,
                         const StereoDepth& map, int reference, std::span<const int> neighbours,
                         const SubjectRegion& region, const PatchMatchOptions& options, std::uint64_t seed);

}  // namespace gyre
