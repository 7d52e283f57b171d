// SPDX-License-Identifier: Apache-2.0
// Mouth and nostrils in a face map.
#pragma once

#include "offload/landmarks/face_map.h"

#include <array>
#include <string>

namespace gyre {

// Places in the face's frame, metres; left (at positive x), right.
struct FeaturePair {
  std::array<Eigen::Vector2d, 2> place;
  double deviation = 0.0;
};

// The ends of the dark line between the lips: the line is the best path through the valley of lightness (dynamic
// programming), its ends are where valley and red of the lips cease (cumulative sums, Page, Biometrika 1954).
// `line`: the height the profile gives the line, metres. The error is why there are none.
tl::expected<FeaturePair, std::string> find_mouth_corners(const FaceMap& map, double line, double scale);

// Two dark places under the tip of the nose, at equal height to both sides; `base` and `tip` are the heights of the
// nose's base and tip.
tl::expected<FeaturePair, std::string> find_nostrils(const FaceMap& map, double base, double tip, double scale);

}  // namespace gyre
