// SPDX-License-Identifier: Apache-2.0
// The angle of a turntable at any moment, from samples that come in at their own pace.
#pragma once

#include <deque>
#include <mutex>
#include <optional>

namespace gyre {

struct TurntableAngleOptions {
  double longest_gap = 0.25;  // between two samples that are joined, seconds
  double ahead = 0.15;        // for which the table is taken to go on as it went after the last sample, seconds
  double memory = 10.0;       // for which samples are kept, seconds
};

// From any thread. Times: seconds, CLOCK_MONOTONIC, see CameraDevice::time_zero for those of frames.
class TurntableAngle {
 public:
  explicit TurntableAngle(const TurntableAngleOptions& options = {}) : options_(options) {}

  // angle: of what stands on the table, radians, counter-clockwise seen from above, wrapped or not; less than half a
  // turn from the sample before. One that is not later than that is left out.
  void add(double time, double angle);

  // Not wrapped, on the line between the samples before and after; nothing outside of the samples or in a gap.
  std::optional<double> at(double time) const;

 private:
  struct Sample {
    double time = 0.0;
    double angle = 0.0;
  };

  TurntableAngleOptions options_;
  mutable std::mutex mutex_;  // guards what follows
  std::deque<Sample> samples_;
};

}  // namespace gyre
