// SPDX-License-Identifier: Apache-2.0
// Which way somebody faces, from what the cloud shows of feet, nose and hands.
#pragma once

#include "offload/landmarks/face_frame.h"
#include "offload/landmarks/legs.h"
#include "offload/landmarks/limb.h"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace gyre {

// What the cloud shows; [0] is side 0 or the direction +across, [1] the other.
struct BodyParts {
  std::array<std::optional<Arm>, 2> arms;
  std::array<std::string, 2> arm_reasons;  // why there is none
  std::array<std::optional<Foot>, 2> feet;
  std::array<std::optional<FaceFrame>, 2> faces;  // a nose towards +across and away from there
};

struct Facing {
  std::optional<bool> towards_across;  // empty: not decided
  double yaw = 0.0;                    // radians counter-clockwise from above, 0 = +Z; valid when decided
  double certainty = 0.0;              // 0 ... 1
  std::vector<std::string> reasons;    // one sentence each

  // Which side is the left one; valid when decided.
  int left() const { return *towards_across ? 0 : 1; }
};

// Each cue speaks for one direction with a log-likelihood ratio that is bounded by how far the cue can be trusted
// (feet 4, face 4, hands 1.5). The sum must exceed 2.5 and no cue may speak against it with more than 1; else the
// facing stays open.
Facing decide_facing(const Figure& figure, const BodyParts& parts);

}  // namespace gyre
