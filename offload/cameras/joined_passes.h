// SPDX-License-Identifier: Apache-2.0
// A pass that shares no features with the others, as a head pass under other light, brought into their model by its
// shape.
#pragma once

#include "offload/cameras/cloud_alignment.h"
#include "offload/cameras/reconstruction.h"
#include "offload/cameras/world_frame.h"

#include <span>
#include <vector>

namespace gyre {

struct JoinOptions {
  double min_missing = 0.5;         // share of a pass without cameras that makes it worth a model of its own
  int min_views = 8;                // that model needs, and half of the pass
  double least_distance = 0.3;      // of its cameras from what they look at, metres ...
  double largest_distance = 2.0;    // ... at most
  double subject_share = 0.5;       // of that distance, around the place they look at, is the subject
  double head_share = 0.3;          // of the subject's height below the crown, compared
  double reach_share = 0.03;        // of the subject's height, see CloudAlignmentOptions::reach
  double largest_residual = 0.008;  // of the subject's height: beyond it the shapes do not agree
};

struct JoinedPass {
  int pass = 0;
  int views = 0;          // that have found their camera
  double residual = 0.0;  // CloudAlignment's, metres
  double overlap = 0.0;
};

// For every pass of `scene` most of whose views have no camera: a model of that pass alone, with the lenses the scene
// has by now, aligned by its cloud (align_clouds) to the head and shoulders of the subject in the scene's. Its views,
// tracks and points become the scene's. pairs: verified; only those within the pass count. Passes whose views make no
// model, or whose model fits nowhere, stay as they are, with a warning in the log. The scene is in its own arbitrary
// frame; `known` as in find_world.
std::vector<JoinedPass> join_passes(Scene& scene, std::span<const ViewPair> pairs, const KnownLengths& known,
                                    const ReconstructionOptions& reconstruction, const JoinOptions& options = {});

}  // namespace gyre
