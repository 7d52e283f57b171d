// SPDX-License-Identifier: Apache-2.0
// Stage `landmarks`: named places of the body and the face in the cloud, and which way the subject faces.
#pragma once

#include "common/bundle/stage.h"

namespace gyre {

// In: work/cloud/cloud.ply, work/cameras, frames/. Out: landmarks.json (offload/body/landmark_set.h).
Stage landmarks_stage();

}  // namespace gyre
