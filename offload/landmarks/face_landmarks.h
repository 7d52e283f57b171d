// SPDX-License-Identifier: Apache-2.0
// The face's landmarks from the shape of the head and from the pictures that show it from the front.
#pragma once

#include "offload/landmarks/detector.h"

namespace gyre {

// Adds them, or why they are missing. Needs the facing: without it a face has no left side.
void find_face_landmarks(const Subject& subject, Detections& detections);

}  // namespace gyre
