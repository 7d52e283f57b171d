// SPDX-License-Identifier: Apache-2.0
// Depth and normal of every pixel of a view by PatchMatch over slanted planes.
#pragma once

#include "offload/cloud/patch_cost.h"
#include "offload/cloud/stereo_view.h"
#include "offload/cloud/subject_region.h"

#include <cstdint>
#include <span>
#include <vector>

namespace gyre {

// What is known of a pixel.
enum class PixelState : std::uint8_t {
  unknown,
  beyond,   // matched at a smaller pyramid level, outside the region: depth only
  surface,  // depth, normal and cost
};

// Depth of each pixel of a view at its working size, row major.
struct StereoDepth {
  int width = 0;
  int height = 0;
  std::vector<PixelState> state;
  std::vector<float> depth;             // metres along the optical axis; 0 for unknown
  std::vector<Eigen::Vector3f> normal;  // unit, in camera coordinates, towards the camera
  std::vector<float> cost;              // matching cost, 0 best

  std::size_t index(int x, int y) const { return static_cast<std::size_t>(y) * width + x; }
};

// More neighbours of a view than this are not looked at.
inline constexpr int max_neighbours = 12;

struct PatchMatchOptions {
  int coarse_iterations = 5;      // at the smallest level, from random planes
  int fine_iterations = 2;        // at each larger one, from the level below
  int best_views = 3;             // a hypothesis is judged by the mean cost of this many of its views
  float background_reach = 3.0F;  // planes are sought this many times as far as the box's far end, so that background
                                  // finds its own depth instead of a wrong one inside the box
  float keep_cost = 0.75F;        // a coarse pixel worse than this is not followed to the larger level
  float beyond_cost = 0.5F;       // and one outside the region is remembered as beyond when it is better than this
  float consistency_weight = 0.15F;  // cost of a pixel of forward-backward reprojection error (geometric pass)
  float consistency_limit = 3.0F;    // pixels at which that error saturates
  PatchOptions patch;
};

// Photometric estimate for views[reference] against `neighbours`: coarse to fine, red-black propagation from eight
// regions (Galliani et al., ICCV 2015, section 3; Xu and Tao, CVPR 2019, section 3.1) and random refinement whose
// numbers depend only on the seed and the pixel. Only pixels whose ray meets the region are looked at.
StereoDepth estimate_depth(std::span<const StereoView> views, int reference, std::span<const int> neighbours,
                           const SubjectRegion& region, const PatchMatchOptions& options, std::uint64_t seed);

// One more pass from maps[reference] with the forward-backward reprojection error against the neighbours' maps added
// to the matching cost (Schönberger et al., ECCV 2016, eq. 13).
StereoDepth refine_depth(std::span<const StereoView> views, std::span<const StereoDepth> maps, int reference,
                         std::span<const int> neighbours, const SubjectRegion& region, const PatchMatchOptions& options,
                         std::uint64_t seed);

}  // namespace gyre
