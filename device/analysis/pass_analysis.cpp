// SPDX-License-Identifier: Apache-2.0
#include "device/analysis/pass_analysis.h"

#include "common/selection/frame_room.h"

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
                           const MeasureOptions& options, int room)
    : photographs_(camera.photographs),
      analysis_(camera, calibrated, options),
      selector_(streaming_options(pass, camera), room),
      times_(room_for<double>(room)) {}

std::optional<Frame> PassAnalysis::add(Frame frame) {
  reading_ = analysis_.add(frame, frame.settings.exposure_s);
  const FrameMeasure& measure = reading_.measure;
  if (settings_.empty() || settings_.back().settings != frame.settings) settings_.push_back({count(), frame.settings});
  times_.push_back(frame.time);
  const std::optional<int> proposed = selector_.push(measure);
  if (photographs_) return frame;

  recent_.push_back(std::move(frame));
  if (recent_.size() > static_cast<std::size_t>(selector_.latency()) + 1) recent_.pop_front();
  if (!proposed) return std::nullopt;
  const auto found =
      std::find_if(recent_.begin(), recent_.end(), [&](const Frame& recent) { return recent.index == *proposed; });
  return found == recent_.end() ? std::nullopt : std::optional<Frame>(*found);
}

std::vector<MeasuredFrame> PassAnalysis::frames() const {
  std::vector<MeasuredFrame> frames;
  frames.reserve(times_.size());
  std::size_t now = 0;
  for (int i = 0; i < count(); ++i) {
    if (now + 1 < settings_.size() && settings_[now + 1].index == i) ++now;
    const auto at = static_cast<std::size_t>(i);
    frames.push_back({times_[at], measures()[at], settings_[now].settings});
  }
  return frames;
}

Result<Selection> PassAnalysis::finish() const {
  return photographs_ ? keep_all(selector_.frames()) : selector_.finish();
}

}  // namespace gyre
