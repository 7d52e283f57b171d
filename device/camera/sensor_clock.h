// SPDX-License-Identifier: Apache-2.0
// By which clock a camera stamps its frames. Drivers may use any: V4L2 says CLOCK_MONOTONIC and libcamera says
// CLOCK_BOOTTIME, but passes on what the driver wrote.
#pragma once

#include <optional>

namespace gyre {

class SensorClock {
 public:
  // stamp: of a frame that has just come. monotonic, boot: the machine's clocks now. All in seconds.
  void add(double stamp, double monotonic, double boot);

  // What to add to a stamp to get CLOCK_MONOTONIC. Exact when the stamps are of a clock of the machine's, otherwise
  // too large by the least time a frame took to come.
  std::optional<double> offset() const { return offset_; }
  void restart() { offset_.reset(); }

 private:
  std::optional<double> offset_;
  bool known_clock_ = true;
};

// The machine's clocks, seconds.
double monotonic_now();
double boot_now();

}  // namespace gyre
