// SPDX-License-Identifier: Apache-2.0
// Which keypoints of which pictures show the same thing: pairs, matches, epipolar geometry.
#pragma once

#include "common/log/log.h"
#include "offload/cameras/features.h"
#include "offload/cameras/pairs.h"
#include "offload/cameras/scene.h"
#include "offload/cameras/verification.h"

#include <span>
#include <vector>

namespace gyre {

struct CorrespondenceOptions {
  bool ordered = true;  // pictures of a pass are in order of capture
  PairOptions pairs;
  MatchOptions matching;
  VerificationOptions verification;
  int threads = 0;
};

// Verified pairs of the pictures. pass_of: per picture, which walk it belongs to.
std::vector<ViewPair> find_correspondences(std::span<const Features> features, std::span<const int> pass_of,
                                           const CorrespondenceOptions& options, const Progress& progress);

}  // namespace gyre
