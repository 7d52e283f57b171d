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
  int max_gap = 10;            // keyframes from the placed neighbour before to the one after, at most
  int guesses = 9;             // poses tried, evenly between the neighbours'
  int references_in_walk = 4;  // sharp views nearest in the walk that points and patches are taken from
  int references_beside = 12;  // and those that stand nearest, on whichever walk
  double max_angle = 0.8;      // between the latter's orientation and the one looked for, radians
  double calm_share = 0.7;     // of the points, those that move least from neighbour to neighbour
  // Of the pictures, one after the other; the guesses are tried at the first.
  std::vector<double> scales{0.25, 0.25, 0.5, 0.5};
  double smoothing = 1.5;  // standard deviation of the Gaussian over the resized pictures, pixels
  // Share of the way between the neighbours that was walked during the exposure.
  double least_exposure = 0.02, most_exposure = 0.25;
  int exposure_rounds = 3;
  double max_error = 2.5;    // pixels of the resized picture
  double usual_error = 1.0;  // of a patch, pixels of the resized picture
  int min_inliers = 20;
  double min_inlier_share = 0.4;  // of the patches found at last
  double max_stray = 1.5;         // distance from each neighbour's centre, in units of the distance between the two
  PatchAlignmentOptions patches;
};

// The 8-bit grey picture of a view; empty when it cannot be read.
using PictureOfView = std::function<cv::Mat(int view)>;

// Tries to place every view of `scene` that is not registered and has placed views before and after it in its pass.
// Where on the way between them it was taken, and how long the exposure was, is tried out: the guess by which most
// patches of the neighbours' pictures, smeared as the walk smears them, lie in its own where they must. Points and
// other views stay as they are, so that a blurred picture cannot harm them, and the view takes part in no track.
// Returns the views it has placed.
std::vector<int> place_between_neighbours(Scene& scene, const PictureOfView& picture_of,
                                          const PatchResectionOptions& options = {});

}  // namespace gyre
