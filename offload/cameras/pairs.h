// SPDX-License-Identifier: Apache-2.0
// Which pictures are worth matching with each other, from the order of capture and a cheap look at their content.
#pragma once

#include "offload/cameras/features.h"

#include <Eigen/Core>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace gyre {

// What the capture itself says of its pictures.
struct CaptureOrder {
  std::vector<int> pass_of;  // per picture, which walk it belongs to
  bool ordered = true;       // pictures of a pass are in order of capture
  // Per picture, as a device measured them; may be empty. Degrees around the subject; larger is sharper.
  std::vector<std::optional<double>> azimuth;
  std::vector<double> sharpness;
};

struct PairOptions {
  int neighbours = 4;    // pictures before and after in the same pass
  int largest_step = 8;  // and those 8, 16, ... apart, doubling up to this
  int best_votes = 7;    // most similar others of each picture
  int best_votes_other_pass = 3;
  int min_votes = 4;           // matches among the largest features for a picture to count as similar
  int voting_features = 300;   // largest features of each picture that vote
  int exhaustive_up_to = 150;  // unordered pictures: match all with all up to this many
  int same_azimuth = 3;        // sharpest pictures of other rings of a pass from nearly the same side
  double azimuth_range = 12;   // degrees that is, at most
};

// Matches among the largest features of every two pictures (Wu, "Towards linear-time incremental structure from
// motion", 3DV 2013, section 2: large features match more often); symmetric, zero diagonal.
Eigen::MatrixXi similarity_votes(std::span<const Features> features, const PairOptions& options, int threads);

// Pairs (a < b) to match, sorted. Neighbours in order; the vote closes rings and links rings and passes, and azimuths,
// where a device wrote them, do so as well for the rings of a pass.
std::vector<std::pair<int, int>> choose_pairs(const CaptureOrder& order, const Eigen::MatrixXi& votes,
                                              const PairOptions& options);

}  // namespace gyre
