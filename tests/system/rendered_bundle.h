// SPDX-License-Identifier: Apache-2.0
// Rendered captures as bundles, and what the cameras stage makes of them against the truth.
#pragma once

#include "common/bundle/stage.h"
#include "common/geometry/pose.h"
#include "common/result/result.h"
#include "tests/synthetic/capture.h"
#include "tests/temporary_folder.h"

#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace gyre {

// What the walks of these tests have in common: two rings, 360 x 640 pixels, one keyframe every 13 degrees.
synthetic::CaptureOptions small_walk();

// A bundle under construction in a folder of its own, with the true cameras of its keyframes.
class RenderedBundle {
 public:
  // height_mm: as given by the operator.
  explicit RenderedBundle(double height_mm = 1700);

  // Renders the given frames of `capture` (empty: all) and appends them to the keyframes of `pass`, in their order.
  void add(const std::string& pass, const synthetic::Capture& capture, std::vector<int> frames = {});

  const Bundle& bundle() const { return bundle_; }
  // Cameras by the name of their keyframe.
  const std::map<std::string, Pose>& truth() const { return truth_; }

 private:
  TemporaryFolder folder_;
  Bundle bundle_{""};
  Scan scan_;
  std::map<std::string, Pose> truth_;
};

struct CameraFigures {
  Similarity truth_from_world;  // that aligns the centres
  nlohmann::json scene;         // scene.json
  nlohmann::json result;        // of the stage
  int total = 0, registered = 0;
  double median_mm = 0.0, largest_mm = 0.0;  // of the centres, after similarity alignment to the truth
  double axis_mm = 0.0;                      // horizontal distance of the world's axis from the subject's
  double tilt_deg = 0.0;                     // of the world's up
  double floor_mm = 0.0;                     // height of the world's floor over the true one
  double scale_percent = 0.0;                // of lengths, against the truth
};

// Runs a stage on the bundle, with its usual options but for `changed`, into its folder. Error: the stage's own.
Result<nlohmann::json> run_stage(const Stage& stage, const RenderedBundle& rendered,
                                 const nlohmann::json& changed = {});

// Runs the cameras stage and measures. Error: the stage's own.
Result<CameraFigures> place_cameras(const RenderedBundle& rendered);

// One line for the test's log.
std::string to_text(const CameraFigures& figures);

}  // namespace gyre
