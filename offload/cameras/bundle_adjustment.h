// SPDX-License-Identifier: Apache-2.0
// Bundle adjustment: poses, points and lenses that explain all keypoints best.
#pragma once

#include "offload/cameras/scene.h"

#include <vector>

namespace gyre {

// What of a camera is adjusted. Each includes the ones before it.
enum class LensFreedom {
  fixed,
  focal,       // one focal length and k1
  principal,   // fx and fy, principal point, k2
  tangential,  // p1, p2
};

struct BundleOptions {
  LensFreedom lens = LensFreedom::focal;
  std::vector<int> free_views;  // poses that move; empty: all registered ones but the first, which fixes the world
  bool free_points = true;
  double loss_scale = 1.0;      // of the Cauchy loss, pixels
  int min_observations = 2;     // shorter tracks neither count nor move
  int max_points_per_view = 0;  // 0: all; else tracks are taken, longest first, until every view has this many
  int max_iterations = 50;
  double tolerance = 1e-6;  // stop when the cost falls by a smaller share
};

struct BundleSummary {
  double initial_cost = 0.0;
  double final_cost = 0.0;
  int iterations = 0;
  int observations = 0;
};

// Minimises sum rho(|r|^2) with r the reprojection error in pixels over used observations of triangulated tracks, rho
// Cauchy's (Triggs et al., "Bundle adjustment - a modern synthesis", 1999), by Levenberg-Marquardt with the points
// eliminated (Schur complement). Weak priors keep a lens that the views do not determine at a usual one. Runs on one
// thread, so that its result is the same everywhere. View::normalised is stale afterwards if the lens moved.
BundleSummary adjust_bundle(Scene& scene, const BundleOptions& options);

}  // namespace gyre
