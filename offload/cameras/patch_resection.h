// SPDX-License-Identifier: Apache-2.0
// Cameras for pictures too blurred for features, between their neighbours in the walk.
#pragma once

#include "offload/cameras/patch_alignment.h"
#include "offload/cameras/scene.h"

#include <functional>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace gyre {

struct PatchResectionOptions {
  int max_gap = 10;         // keyframes from the placed neighbour before to the one after, at most
  int guesses = 9;          // poses tried, evenly between the neighbours'
  int references = 6;       // placed views nearest in the walk that points and patches are taken from
  double calm_share = 0.7;  // of the points, those that move least from neighbour to neighbour
  // Of the pictures, one after the other; the guesses are tried at the first.
  std::vector<double> scales{0.25, 0.25, 0.5, 0.5};
  double smoothing = 1.5;  // standard deviation of the Gaussian over the resized pictures, pixels
  double max_error = 2.5;  // pixels of the resized picture
  int min_inliers = 20;
  double min_inlier_share = 0.3;  // of the patches found at the last scale
  double max_stray = 1.5;         // distance from each neighbour's centre, in units of the distance between the two
  PatchAlignmentOptions patches;
};

// The 8-bit grey picture of a view; empty when it cannot be read.
using PictureOfView = std::function<cv::Mat(int view)>;

// Tries to place every view of `scene` that is not registered and has placed views before and after it in its pass.
// Where on the way between them it was taken is tried out: the guess by which most patches of the neighbours' pictures
// lie in its own where they must is made exact by the same means. Points and other views stay as they are, so that a
// blurred picture cannot harm them, and the view takes part in no track. Returns the views it has placed.
std::vector<int> place_between_neighbours(Scene& scene, const PictureOfView& picture_of,
                                          const PatchResectionOptions& options = {});

}  // namespace gyre
