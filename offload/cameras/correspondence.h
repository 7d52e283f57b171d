// SPDX-License-Identifier: Apache-2.0
// Which keypoints of which pictures show the same thing: pairs, matches, epipolar geometry.
#pragma once

#include "common/log/log.h"
#include "offload/cameras/features.h"
#include "offload/cameras/pairs.h"
#include "offload/cameras/scene.h"
#include "offload/cameras/static_background.h"
#include "offload/cameras/verification.h"

#include <span>
#include <vector>

namespace gyre {

struct CorrespondenceOptions {
  PairOptions pairs;
  MatchOptions matching;
  VerificationOptions verification;
  StillnessOptions stillness;
  int threads = 0;
};

// Verified pairs of the pictures. background: what was found of them, whose still keypoints the features no longer
// have.
std::vector<ViewPair> find_correspondences(std::span<const Features> features, const CaptureOrder& order,
                                           const StaticBackground& background, const CorrespondenceOptions& options,
                                           const Progress& progress);

}  // namespace gyre
