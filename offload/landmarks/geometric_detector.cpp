// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/geometric_detector.h"

#include "offload/landmarks/body_landmarks.h"
#include "offload/landmarks/face_landmarks.h"

namespace gyre {

Result<Detections> GeometricDetector::detect(const Subject& subject, const Progress& progress) {
  Detections found;
  progress(0.0, "body landmarks");
  find_body_landmarks(subject, found);
  progress(0.3, "face landmarks");
  find_face_landmarks(subject, found);
  for (const std::string& name : landmark_names()) {
    const bool placed = std::any_of(found.placed.begin(), found.placed.end(),
                                    [&](const PlacedLandmark& mark) { return mark.name == name; });
    if (!placed) found.missing.emplace(name, "the shape of the cloud does not tell");
  }
  return found;
}

}  // namespace gyre
