// SPDX-License-Identifier: Apache-2.0
// The subject as detectors are given it.
#pragma once

#include "offload/landmarks/detector.h"

namespace gyre {

// Measures figure, limbs, face and facing of a cloud. Fails when the cloud has too few points to be a person.
Result<Subject> make_subject(PointCloud cloud, std::vector<LandmarkView> views);

}  // namespace gyre
