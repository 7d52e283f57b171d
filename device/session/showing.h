// SPDX-License-Identifier: Apache-2.0
// What a session shows: what its frames say, what the operator is told of it, and the status that everybody sees.
#pragma once

#include "device/camera/camera_device.h"
#include "device/guidance/guidance.h"
#include "device/session/host_watch.h"
#include "device/session/live_status.h"
#include "device/session/observer.h"
#include "device/session/open_scan.h"

#include <array>
#include <deque>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

namespace gyre {

// How many frames came during the last second.
class RateMeter {
 public:
  void frame(double now) { times_.push_back(now); }
  double rate(double now) {
    while (!times_.empty() && times_.front() < now - 1.0) times_.pop_front();
    return static_cast<double>(times_.size());
  }

 private:
  std::deque<double> times_;
};

// Belongs to one thread. Times in seconds, ascending.
class Showing {
 public:
  // A pass begins.
  void begin_pass(const std::string& pass, bool is_last_pass);

  // A frame came; while nothing is recorded only its light is looked at, a few times a second.
  void idle_frame(double now, const cv::Mat& bgr);
  void recorded_frame(double now, const PassRecorder& recorder);

  // What is known beside the frames.
  struct Surroundings {
    bool is_recording = false;
    bool has_camera = true;
    bool has_disk = true;
    bool has_host = true;
  };
  void guide(double now, const Surroundings& around);

  // All but what only the session knows: fault, notice and room on the disk.
  LiveStatus status(double now, SessionState state, const OpenScan& scan, const HostWatch& host);

 private:
  void show_map(const CoverageMap& map);

  RateMeter rate_;
  double looked_at_ = -1e9;
  std::optional<Observer> observer_;
  Guidance guidance_;
  Observation seen_;  // last
  // Of the pass that is on, or was last.
  std::optional<CoverageReading> place_;
  std::array<std::array<CellStatus, CoverageMap::sectors>, all_bands.size()> cells_{};
  int frames_ = 0;
};

}  // namespace gyre
