// SPDX-License-Identifier: Apache-2.0
// The body's landmarks from the shape of the cloud: crown, shoulders, arms, hands, crotch, legs, feet.
#pragma once

#include "offload/landmarks/detector.h"

namespace gyre {

// Adds them, or why they are missing. A place without cloud gets no landmark. Where clothes or the lack of shape leave
// only the usual proportions to tell how far along a limb a landmark lies, its covariance says so.
void find_body_landmarks(const Subject& subject, Detections& detections);

}  // namespace gyre
