// SPDX-License-Identifier: Apache-2.0
// What several detectors say, as one set.
#pragma once

#include "offload/landmarks/detector.h"

#include <memory>
#include <vector>

namespace gyre {

// Runs the detectors and keeps, of every name, what the last of them that placed it says: the order is that of
// increasing trust (geometric, network, picked). A left and a right that contradict the facing decided from geometry
// are dropped from a network's results, not from a person's. Fails when a detector does.
Result<LandmarkSet> detect_landmarks(const Subject& subject,
                                     const std::vector<std::unique_ptr<LandmarkDetector>>& detectors,
                                     const Progress& progress);

}  // namespace gyre
