// SPDX-License-Identifier: Apache-2.0
#include "device/analysis/focus.h"

#include <algorithm>
#include <cmath>

namespace gyre {

FocusReading FocusWatch::add(double time, double sharpness, double motion) {
  best_ = std::max(sharpness, best_ * std::exp(-std::max(0.0, time - time_) / options_.memory_s));
  time_ = time;
  FocusReading reading;
  reading.sharpness = best_ > 0.0 ? sharpness / best_ : 0.0;
  reading.is_sharp = reading.sharpness >= options_.sharp;
  reading.is_hunting = reading.sharpness < options_.searching && motion < options_.steady_motion;
  return reading;
}

}  // namespace gyre
