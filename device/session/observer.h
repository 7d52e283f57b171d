// SPDX-License-Identifier: Apache-2.0
// What guidance is told of a pass: from the readings of its frames.
#pragma once

#include "device/analysis/frame_analysis.h"
#include "device/coverage/coverage.h"
#include "device/guidance/guidance.h"

#include <array>
#include <deque>
#include <optional>
#include <string>

namespace gyre {

// Of one pass, frame by frame. Belongs to one thread.
class Observer {
 public:
  Observer(std::string pass, bool is_last_pass) : pass_(std::move(pass)), is_last_pass_(is_last_pass) {}

  // The next frame. place: where it was taken from, when that is known of such passes; map: of the pass so far. The
  // observation has the frame's time, and leaves camera, disk and host as they are by default.
  Observation add(const FrameReading& frame, const std::optional<CoverageReading>& place, const CoverageMap& map);

 private:
  struct Way {
    double time = 0.0;
    double azimuth = 0.0;
  };
  std::optional<double> approach(double time, const CameraMotion& camera);
  std::optional<bool> subject(double time, const CameraMotion& camera);
  std::optional<double> azimuth_rate(double time, const OrbitPlace& place);
  bool is_complete(Band band, const CoverageMap& map) const;

  std::string pass_;
  bool is_last_pass_;
  std::array<bool, all_bands.size()> is_closed_{};   // rings that were walked all around
  std::deque<Way> way_;                              // of the last third of a second
  std::optional<double> usual_;                      // logarithm of the distance
  double log_distance_ = 0.0, distance_time_ = 0.0;  // of the last frame
  std::optional<bool> has_subject_;                  // as far as it is known
  double subject_seen_at_ = 0.0;                     // when it was known last
};

// What is known of a frame while nothing is recorded, from its picture alone.
Observation observe_idle(double time, const cv::Mat& bgr);

}  // namespace gyre
