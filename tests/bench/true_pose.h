// SPDX-License-Identifier: Apache-2.0
// Where the camera of a captured frame truly was, seen from the subject.
#pragma once

#include "common/geometry/pose.h"

#include <nlohmann/json_fwd.hpp>

namespace gyre::bench {

// `frame`: an entry of truth.json's frames. The world turns with the subject, so that a fixed camera before a turning
// subject goes around it; the small movements of limbs and trunk stay.
Pose true_pose(const nlohmann::json& frame);

}  // namespace gyre::bench
