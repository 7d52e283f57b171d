// SPDX-License-Identifier: Apache-2.0
// Landmarks without any trained weight: from the shape of the cloud and from edges in the pictures of the face.
#pragma once

#include "offload/landmarks/detector.h"

namespace gyre {

class GeometricDetector : public LandmarkDetector {
 public:
  std::string source() const override { return "geometric"; }
  // Never fails: what cannot be found is missing.
  Result<Detections> detect(const Subject& subject, const Progress& progress) override;
};

}  // namespace gyre
