// SPDX-License-Identifier: Apache-2.0
// Cameras for pictures that plain matching could not place, from where their neighbours in the walk say they must be.
#pragma once

#include "offload/cameras/features.h"
#include "offload/cameras/scene.h"

#include <span>
#include <vector>

namespace gyre {

struct GuidedResectionOptions {
  int max_gap = 10;          // keyframes between the placed neighbours before and after, at most
  int views_asked = 8;       // placed views nearest in the walk whose points are looked for
  double radius = 0.1;       // of the longer side: how far from where it should be a point is first looked for
  double last_radius = 8.0;  // pixels, once the pose is nearly known
  double max_ratio = 0.9;    // nearest to second nearest descriptor inside the radius
  double max_distance = 0.9;
  double max_error = 4.0;  // pixels
  int min_inliers = 16;
  int min_cells = 8;       // of a 12 x 12 grid over the picture that inliers lie in
  double max_stray = 1.0;  // distance from the guessed centre, in units of the gap between the neighbours' centres
};

// Tries to place every view of `scene` that is not registered. A pose guessed from the views before and after in the
// same pass tells where each point must be; among the few keypoints there even blurred descriptors are distinct. The
// pose is found from points that stay as they are, so that a blurred picture cannot harm the others; its keypoints
// join the tracks. features: per view. Returns the views it has placed.
std::vector<int> place_between_neighbours(Scene& scene, std::span<const Features> features,
                                          const GuidedResectionOptions& options = {});

}  // namespace gyre
