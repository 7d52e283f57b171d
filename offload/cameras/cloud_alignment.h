// SPDX-License-Identifier: Apache-2.0
// Two sparse clouds of one upright thing, without common points: the similarity between them.
#pragma once

#include "common/geometry/pose.h"

#include <Eigen/Core>
#include <optional>
#include <span>

namespace gyre {

struct CloudAlignmentOptions {
  double least_scale = 0.2;    // of a_from_b; the scales tried lie between the two ...
  double largest_scale = 2.0;  // ... in equal ratios
  double scale_step = 1.08;
  int headings = 36;               // tried of a full turn
  double depth = 0.3;              // of the top of the clouds that is compared, unit of a
  double reach = 0.05;             // distance beyond which a point counts as one without counterpart, unit of a
  int best = 8;                    // of the tried transforms that are refined
  int iterations = 60;             // of a refinement
  double min_overlap = 0.5;        // share of the points of either cloud that need a counterpart
  std::size_t most_points = 1200;  // of each cloud that are looked at, evenly taken
};

struct CloudAlignment {
  Similarity a_from_b;
  double residual = 0.0;  // median distance of a point to the other cloud's nearest, both ways, unit of a
  double overlap = 0.0;   // share of points with a counterpart within reach, the smaller of both ways
};

// Both clouds have +Y up and the thing's top among their points: scale, heading and place are tried with the tops put
// on each other, and the best of them refined by iterated closest points in both directions (Besl and McKay, PAMI 1992;
// trimmed as in Chetverikov et al., ICPR 2002) with the scale free. Both directions count, or a small cloud would fit
// anywhere. Nothing when either cloud has fewer than 50 points near its top or no transform gives enough overlap.
std::optional<CloudAlignment> align_clouds(std::span<const Eigen::Vector3d> a, std::span<const Eigen::Vector3d> b,
                                           const CloudAlignmentOptions& options = {});

}  // namespace gyre
