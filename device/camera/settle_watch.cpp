// SPDX-License-Identifier: Apache-2.0
#include "device/camera/settle_watch.h"

#include <algorithm>

namespace gyre {

void SettleWatch::begin(std::chrono::milliseconds patience) {
  patience_ = patience;
  restart();
}

void SettleWatch::restart() {
  recent_.clear();
  begun_.reset();
}

bool SettleWatch::is_late() const {
  return begun_ && recent_.back().time - *begun_ >= patience_.count();
}

bool SettleWatch::add(double time, double brightness) {
  constexpr double rest = 0.5;    // seconds
  constexpr double levels = 2.0;  // of 255; what noise and a swaying subject do
  if (!begun_) begun_ = time;
  recent_.push_back({time, brightness});
  // One reading stays that is older, so that the rest is covered from end to end.
  while (recent_.size() > 1 && recent_[1].time <= time - rest) recent_.pop_front();
  const auto [darkest, brightest] = std::minmax_element(
      recent_.begin(), recent_.end(), [](const Reading& a, const Reading& b) { return a.brightness < b.brightness; });
  return recent_.front().time <= time - rest && brightest->brightness - darkest->brightness <= levels;
}

}  // namespace gyre
