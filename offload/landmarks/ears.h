// SPDX-License-Identifier: Apache-2.0
// The ears, where hair leaves them free, from the relief of the head's sides.
#pragma once

#include "offload/landmarks/face_frame.h"

#include <array>
#include <optional>
#include <string>

namespace gyre {

struct EarMarks {
  Eigen::Vector3d tip = Eigen::Vector3d::Zero();   // where the rim stands out farthest; metres, in the face's frame
  Eigen::Vector3d lobe = Eigen::Vector3d::Zero();  // its lowest point
};

// Seen from the side, an auricle is what stands out from the head with a step behind its rim. An ear has to look like
// the mirror image of the other one: where only one is found, or they differ, there is hair. sides[0] holds the points
// that can be seen from the left, sides[1] from the right, in the world; stature in metres. Nothing: no ears to be
// seen; [0] is the left one.
std::optional<std::array<EarMarks, 2>> find_ears(const FaceFrame& frame,
                                                 const std::array<std::vector<Eigen::Vector3d>, 2>& sides,
                                                 double stature);

}  // namespace gyre
