// SPDX-License-Identifier: Apache-2.0
// From rendered pictures to conditions, as a pass is recorded.
#pragma once

#include "device/analysis/frame_analysis.h"
#include "device/coverage/coverage.h"
#include "device/guidance/guidance.h"
#include "device/session/observer.h"
#include "tests/synthetic/capture.h"

#include <optional>
#include <string>

namespace gyre::test {

class Rig {
 public:
  Rig(const std::string& pass, const synthetic::Capture& capture)
      : info_(info_of(capture)),
        analysis_(info_, capture.camera),
        coverage_(pass, capture.camera),
        observer_(pass, true) {}

  // The next picture, at the capture's pace, or at a time of its own with what a turntable told.
  void add(const cv::Mat& picture) { add(picture, count_ / info_.fps); }
  void add(const cv::Mat& picture, double time, std::optional<double> turntable = {}) {
    Frame frame;
    frame.index = count_++;
    frame.time = time;
    frame.image = picture;
    const FrameReading reading = analysis_.add(frame);
    place_ = coverage_.add(reading, analysis_.luma(), turntable);
    seen_ = observer_.add(reading, place_, coverage_.map());
    guidance_.update(seen_);
  }

  const CoverageReading& place() const { return place_; }
  const CoverageMap& map() const { return coverage_.map(); }
  const Observation& seen() const { return seen_; }
  const Guidance& guidance() const { return guidance_; }

 private:
  static CameraInfo info_of(const synthetic::Capture& capture) {
    CameraInfo info;
    info.width = capture.options.width;
    info.height = capture.options.height;
    info.fps = capture.options.fps;
    return info;
  }

  CameraInfo info_;
  FrameAnalysis analysis_;
  Coverage coverage_;
  Observer observer_;
  Guidance guidance_;
  CoverageReading place_;
  Observation seen_;
  int count_ = 0;
};

}  // namespace gyre::test
