// SPDX-License-Identifier: Apache-2.0
// Incremental structure from motion (Schoenberger and Frahm, CVPR 2016) for walks around one subject.
#pragma once

#include "common/log/log.h"
#include "common/result/result.h"
#include "offload/cameras/bundle_adjustment.h"
#include "offload/cameras/consistency.h"
#include "offload/cameras/scene.h"
#include "offload/cameras/seed.h"
#include "offload/cameras/triangulation.h"

#include <optional>
#include <vector>

namespace gyre {

struct ReconstructionOptions {
  bool known_lens = false;                                 // the scene's cameras are calibrated: leave them as they are
  std::vector<double> focal_guesses{0.8, 1.2, 1.75, 2.6};  // times the longer side; the one that explains most wins
  std::optional<double> known_guess;                       // times the longer side, as EXIF says: tried before those
  int trial_views = 8;                                     // views each guess is tried on
  int min_inliers = 20;                                    // points a pose must agree with
  double min_inlier_share = 0.2;                           // of the points the view should see
  double max_pose_error = 8.0;                             // of those points, pixels
  double growth_between_global = 1.2;  // bundle adjustment of everything each time the model has grown by this factor
  int local_views = 6;                 // views adjusted together with a new one
  int max_points_per_view = 400;       // in adjustments while growing
  int full_lens_views = 12;            // views from which on principal point and aspect are adjusted
  TriangulationOptions triangulation;
  SeedOptions seed;
  ConsistencyOptions consistency;
  int threads = 0;
};

struct ReconstructionSummary {
  int registered = 0;
  int removed_pairs = 0;   // contradicted the final model
  double rms_error = 0.0;  // pixels
};

// Poses of as many views as possible, points, and the lenses unless known, in an arbitrary similarity frame. The
// scene's views need keypoints, camera, pass and order; its cameras need a size. Tracks are built from `pairs`, which
// must be verified. Error when no two views start a model or it does not grow beyond them.
Result<ReconstructionSummary> reconstruct(Scene& scene, std::vector<ViewPair> pairs,
                                          const ReconstructionOptions& options, const Progress& progress);

}  // namespace gyre
