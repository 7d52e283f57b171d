// SPDX-License-Identifier: Apache-2.0
// Landmarks from a whole-body keypoint network.
#pragma once

#include "offload/landmarks/detector.h"
#include "offload/landmarks/keypoint_network.h"

namespace gyre {

class NetworkDetector : public LandmarkDetector {
 public:
  explicit NetworkDetector(KeypointNetwork network) : network_(std::move(network)) {}
  std::string source() const override { return "network"; }
  // Runs the network on up to 40 views spread over the walk, on the part of each picture that shows the cloud. Fails
  // when the network cannot be run.
  Result<Detections> detect(const Subject& subject, const Progress& progress) override;

 private:
  KeypointNetwork network_;
};

}  // namespace gyre
