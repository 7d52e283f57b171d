// SPDX-License-Identifier: Apache-2.0
#include "device/coverage/turntable_angle.h"

#include <algorithm>
#include <cmath>

namespace gyre {

void TurntableAngle::add(double time, double angle) {
  const std::lock_guard lock(mutex_);
  if (!samples_.empty()) {
    const Sample& last = samples_.back();
    if (time <= last.time) return;
    angle = last.angle + std::remainder(angle - last.angle, 2 * M_PI);
  }
  samples_.push_back({time, angle});
  while (samples_.front().time < time - options_.memory) samples_.pop_front();
}

std::optional<double> TurntableAngle::at(double time) const {
  const std::lock_guard lock(mutex_);
  if (samples_.empty() || time < samples_.front().time) return std::nullopt;
  const auto last_before =
      std::find_if(samples_.rbegin(), samples_.rend(), [&](const Sample& s) { return s.time <= time; });
  const Sample& from = *last_before;
  if (from.time == time) return from.angle;
  if (last_before != samples_.rbegin()) {
    const Sample& to = *std::prev(last_before);
    if (to.time - from.time > options_.longest_gap) return std::nullopt;
    return from.angle + (to.angle - from.angle) * (time - from.time) / (to.time - from.time);
  }
  // The rate over as long: that of two samples would be mostly their rounding.
  if (time - from.time > options_.ahead) return std::nullopt;
  const Sample* before = nullptr;
  for (auto s = std::next(last_before); s != samples_.rend(); ++s) {
    if (std::prev(s)->time - s->time > options_.longest_gap) break;
    before = &*s;
    if (from.time - s->time >= options_.ahead) break;
  }
  if (before == nullptr) return std::nullopt;
  return from.angle + (from.angle - before->angle) * (time - from.time) / (from.time - before->time);
}

}  // namespace gyre
