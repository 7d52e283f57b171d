// SPDX-License-Identifier: Apache-2.0
// The first two views of a reconstruction.
#pragma once

#include "offload/cameras/scene.h"
#include "offload/cameras/triangulation.h"

#include <span>
#include <vector>

namespace gyre {

struct SeedOptions {
  int candidates = 24;  // pairs with most matches that are looked at closely
  int min_points = 40;
  double good_angle = 12 * 0.017453292519943295;  // median ray angle beyond which more parallax earns nothing, radians
  double max_angle = 50 * 0.017453292519943295;   // beyond it matches are few and often false
  TriangulationOptions triangulation;
};

// Pairs fit to start from under the scene's present cameras, best first: many points that lie in front of both views
// under a good angle. View::normalised must be up to date. Empty when no pair will do.
std::vector<ViewPair> rank_seed_pairs(const Scene& scene, std::span<const ViewPair> pairs, const SeedOptions& options,
                                      int threads);

// Registers the pair's views, the first at the origin, the second at distance 1, and triangulates what both see. False
// when fewer than min_points come out.
bool plant_seed(Scene& scene, const ViewPair& pair, const SeedOptions& options);

}  // namespace gyre
