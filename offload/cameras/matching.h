// SPDX-License-Identifier: Apache-2.0
// Exact nearest-neighbour matching of two descriptor sets.
#pragma once

#include "offload/cameras/features.h"

#include <compare>
#include <span>
#include <vector>

namespace gyre {

// Indices of two things that match: descriptors or keypoints of picture a and b.
struct Match {
  int a = 0;
  int b = 0;
  auto operator<=>(const Match&) const = default;
};

struct MatchOptions {
  double max_ratio = 0.8;     // nearest to second nearest distance, both ways
  double max_distance = 0.7;  // of unit vectors
};

// Mutual nearest neighbours that pass Lowe's ratio test (IJCV 2004, section 7.1) in both directions, by brute force
// over all pairs; sorted by a.
std::vector<Match> match_descriptors(std::span<const Descriptor> a, std::span<const Descriptor> b,
                                     const MatchOptions& options = {});

// The same as keypoint indices, each keypoint used at most once, sorted by a.
std::vector<Match> match_features(const Features& a, const Features& b, const MatchOptions& options = {});

}  // namespace gyre
