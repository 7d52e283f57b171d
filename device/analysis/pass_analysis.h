// SPDX-License-Identifier: Apache-2.0
// What is measured and decided on the frames of one pass while it is recorded.
#pragma once

#include "common/selection/ingest.h"
#include "common/selection/streaming.h"
#include "device/analysis/frame_analysis.h"
#include "device/camera/camera_device.h"

#include <deque>
#include <optional>
#include <string>
#include <vector>

namespace gyre {

// Keeps the numbers of every frame, 32 bytes as long as the camera's settings stay, and the pictures of the last few.
// Belongs to one thread.
class PassAnalysis {
 public:
  // Takes the memory for the numbers of `room` frames at once; more may follow.
  PassAnalysis(const std::string& pass, const CameraInfo& camera, const std::optional<Camera>& calibrated = {},
               const MeasureOptions& options = {}, int room = 0);

  // Measures the next frame. Returns the frame that should be sent now, if any: this one or one a little older.
  std::optional<Frame> add(Frame frame);

  // What was measured on the frame added last, and its luma.
  const FrameReading& reading() const { return reading_; }
  const cv::Mat& luma() const { return analysis_.luma(); }

  // The exact selection over all frames. Errors: those of select_keyframes and keep_all.
  Result<Selection> finish() const;

  int count() const { return static_cast<int>(times_.size()); }
  const std::vector<FrameMeasure>& measures() const { return selector_.frames(); }
  // With times and settings; put together when asked for.
  std::vector<MeasuredFrame> frames() const;

 private:
  // Settings hold until they change, which those of a locked camera do not.
  struct SettingsFrom {
    int index = 0;
    FrameSettings settings;
  };

  bool photographs_;
  FrameAnalysis analysis_;
  FrameReading reading_;
  StreamingSelector selector_;
  std::vector<double> times_;
  std::vector<SettingsFrom> settings_;
  std::deque<Frame> recent_;  // the newest last
};

}  // namespace gyre
