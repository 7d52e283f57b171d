// SPDX-License-Identifier: Apache-2.0
#include "device/camera/sensor_clock.h"

#include <algorithm>
#include <ctime>

namespace gyre {

namespace {

double read_clock(clockid_t clock) {
  constexpr double nanoseconds = 1e-9;
  timespec now{};
  ::clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + nanoseconds * static_cast<double>(now.tv_nsec);
}

}  // namespace

void SensorClock::add(double stamp, double monotonic, double boot) {
  constexpr double longest_way = 2.0;  // seconds from the sensor to us, on a busy machine
  if (!offset_) {
    const auto recent = [&](double now) { return now >= stamp && now - stamp < longest_way; };
    known_clock_ = recent(monotonic) || recent(boot);
    offset_ = recent(monotonic) ? 0.0 : recent(boot) ? monotonic - boot : monotonic - stamp;
  } else if (!known_clock_) {
    offset_ = std::min(*offset_, monotonic - stamp);
  }
}

double monotonic_now() {
  return read_clock(CLOCK_MONOTONIC);
}

double boot_now() {
  return read_clock(CLOCK_BOOTTIME);
}

}  // namespace gyre
