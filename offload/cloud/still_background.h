// SPDX-License-Identifier: Apache-2.0
// Pixels of a fixed camera that show the room behind a turning subject.
#pragma once

#include "offload/cloud/stereo_depth.h"
#include "offload/cloud/stereo_view.h"

#include <span>
#include <vector>

namespace gyre {

struct StillBackgroundOptions {
  int window = 7;                // pixels a side of the compared patches
  double min_correlation = 0.8;  // normalised, of a patch with the same place of another view
  double noise = 2.0;            // grey levels; texture below it does not count as equal
  double min_share = 0.3;        // of the compared views of its pass in which a pixel shows the same
  int compared = 20;             // others a view is compared with, at most, evenly spread over the pass
};

// Per view and pixel (row major, working size): 1 where the patch around it is seen at the same place in many views of
// the same pass. What turns with the subject is there in a few of them only, and a patch without texture, which might
// be either, is never counted. The result does not depend on threads.
std::vector<std::vector<char>> still_background(std::span<const StereoView> views,
                                                const StillBackgroundOptions& options, int threads);

// Puts the still pixels of a map far beyond the subject. In the frame that turns with the subject a still background
// has no depth; stereo gives it a false one where a pixel's rays meet: about the axis and at the camera's height.
void put_beyond(StereoDepth& map, const std::vector<char>& still);

}  // namespace gyre
