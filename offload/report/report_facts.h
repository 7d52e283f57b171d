// SPDX-License-Identifier: Apache-2.0
// What a report says about a scan, gathered from the files of its bundle.
#pragma once

#include "common/bundle/bundle.h"
#include "common/geometry/colmap_model.h"
#include "common/result/result.h"
#include "offload/body/landmark_set.h"

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace gyre {

// From work/<stage>/stage.json.
struct StageFacts {
  std::string name;
  int version = 0;
  std::string software;
  double seconds = 0, cpu_seconds = 0, peak_memory_mib = 0;
  nlohmann::json options, result;
};

// A stage that did not get to its end: the last that it said.
struct FailedStage {
  std::string name, log;
};

// Parts that no stage has made are empty or null.
struct ReportFacts {
  Scan scan;
  std::vector<FrameId> keyframes;
  std::vector<std::string> reasons;  // why each keyframe was kept; "" where nobody said
  ColmapModel model;
  nlohmann::json scene, cloud, fit, texture;  // scene.json, cloud.json, fit.json, texture.json
  nlohmann::json coverage;                    // coverage.json of the cloud
  std::optional<LandmarkSet> landmarks;
  std::vector<StageFacts> stages;   // in the order they run
  std::vector<FailedStage> failed;  // those with a work/<stage>.log
  std::uintmax_t avatar_bytes = 0;
  std::string summary;                // the outcome in plain sentences
  std::vector<std::string> warnings;  // one sentence each

  // Azimuth the subject faces in the world of the cameras, radians; 0 until the fit has found it.
  double facing() const;
  // Camera of a keyframe; nullptr when it is not registered.
  const ModelImage* image(const FrameId& frame) const;
};

// Reads everything there is. A missing or damaged part of work/ becomes a warning, not an error; scan.json must be
// there.
Result<ReportFacts> collect_facts(const Bundle& bundle);

// The content of report.json.
nlohmann::json to_json(const ReportFacts& facts);

// "8 min 20 s", "4.2 s".
std::string duration_text(double seconds);

}  // namespace gyre
