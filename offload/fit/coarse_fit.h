// SPDX-License-Identifier: Apache-2.0
// Pose, size and shape of the template against a cloud: robust closest points with exact derivatives.
#pragma once

#include "common/log/log.h"
#include "offload/body/body_state.h"
#include "offload/fit/correspondences.h"
#include "offload/fit/landmark_targets.h"
#include "offload/fit/point_index.h"

namespace gyre {

struct CoarseFitOptions {
  int landmark_iterations = 12;   // on the landmarks alone, when there are enough to hold a body
  int iterations = 36;            // on landmarks and closest points
  int cloud_points = 5000;        // thinned to about this many
  double surface_cell = 0.02;     // metres; the template's vertices are thinned to one a cell
  double first_radius = 0.25;     // metres; the gate shrinks from this ...
  double last_radius = 0.05;      // ... to this
  double min_cosine = 0.5;        // between the normals
  double slide_weight = 0.15;     // of the residual along the surface against the one along its normal
  double clothes_weight = 0.7;    // of cloud points outside of the body; clothes lie there ...
  double hair_weight = 0.05;      // ... and on the head and the neck below it, hair
  double data_deviation = 0.01;   // metres; residual that costs as much as one standard deviation of a prior ...
  double data_count = 600.0;      // ... when this many independent points have it
  double scale_deviation = 0.03;  // of the logarithm of the scale about its mean
  double mean_scale = 1.0;
  int threads = 0;
};

struct CoarseFit {
  BodyState state;
  // Mean distance both ways with the last gate's radius as the value of whatever has no counterpart, metres.
  double misfit = 0.0;
};

// A similarity from landmarks that span the body, in closed form, then Gauss-Newton on the parameters of BodyState:
// first on the landmarks alone, then on landmarks and closest points with the radius annealed; shapes are admitted
// after the pose has settled. Energy per matched point: w (n . d)^2 + slide (d - n n . d)^2 with Geman-McClure weights
// w whose width follows the radius; per landmark its squared Mahalanobis distance, robust in the same way; plus
// Gaussian priors on shape, scale and pose (around the start) and joint limits. A cloud without any match and without
// landmarks leaves the start as it is.
CoarseFit fit_coarse(const BodyTemplate& body, const OuterSurface& outer, const OrientedPoints& cloud,
                     const std::vector<LandmarkTarget>& landmarks, const BodyState& start,
                     const CoarseFitOptions& options = {}, const Progress& progress = {});

}  // namespace gyre
