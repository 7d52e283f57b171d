// SPDX-License-Identifier: Apache-2.0
#include "device/analysis/pass_analysis.h"

#include <algorithm>
#include <cmath>

namespace gyre {

namespace {

// How long W lets a pass take, for cameras that do not end by themselves.
double usual_seconds(const std::string& pass) {
  constexpr double body = 80.0;
  constexpr double head = 30.0;
  return pass == "head" ? head : body;
}

StreamingOptions streaming_options(const std::string& pass, const CameraInfo& camera) {
  StreamingOptions options;
  options.selection = SelectionOptions::for_pass(pass);
  options.expected_frames = camera.expected_frames > 0
                                ? camera.expected_frames
                                : std::max(1, static_cast<int>(std::lround(usual_seconds(pass) * camera.fps)));
  return options;
}

}  // namespace

PassAnalysis::PassAnalysis(const std::string& pass, const CameraInfo& camera, const std::optional<Camera>& calibrated,
                           const MeasureOptions& options)
    : photographs_(camera.photographs),
      analysis_(camera, calibrated, options),
      selector_(streaming_options(pass, camera)) {}

std::optional<Frame> PassAnalysis::add(Frame frame) {
  reading_ = analysis_.add(frame, frame.settings.exposure_s);
  const FrameMeasure& measure = reading_.measure;
  frames_.push_back({frame.time, measure, frame.settings});
  const std::optional<int> proposed = selector_.push(measure);
  if (photographs_) return frame;

  recent_.push_back(std::move(frame));
  if (recent_.size() > static_cast<std::size_t>(selector_.latency()) + 1) recent_.pop_front();
  if (!proposed) return std::nullopt;
  const auto found =
      std::find_if(recent_.begin(), recent_.end(), [&](const Frame& recent) { return recent.index == *proposed; });
  return found == recent_.end() ? std::nullopt : std::optional<Frame>(*found);
}

Result<Selection> PassAnalysis::finish() const {
  return photographs_ ? keep_all(selector_.frames()) : selector_.finish();
}

}  // namespace gyre
