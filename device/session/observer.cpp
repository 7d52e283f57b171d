// SPDX-License-Identifier: Apache-2.0
#include "device/session/observer.h"

#include "common/selection/measure.h"

#include <cmath>
#include <opencv2/core.hpp>

namespace gyre {

namespace {

bool is_ring(Band band) {
  return band != Band::crown && band != Band::chin;
}

}  // namespace

// Over half a second; positive in the direction of the whole way, once that is long enough to tell.
std::optional<double> Observer::azimuth_rate(double time, const OrbitPlace& place) {
  constexpr double span = 0.5;   // seconds
  constexpr double known = 0.4;  // radians
  if (!place.known) {
    way_.clear();
    return std::nullopt;
  }
  way_.push_back({time, place.azimuth});
  while (way_.size() > 2 && way_[1].time <= time - span) way_.pop_front();
  const double passed = time - way_.front().time;
  if (passed < 0.8 * span || std::abs(place.azimuth) < known) return std::nullopt;
  return std::copysign(1.0, place.azimuth) * (place.azimuth - way_.front().azimuth) / passed;
}

bool Observer::is_complete(Band band, const CoverageMap& map) const {
  if (is_ring(band) && !is_closed_[static_cast<std::size_t>(band)]) return false;
  return map.share(band) >= 1.0;
}

Observation Observer::add(const FrameReading& frame, const std::optional<CoverageReading>& place,
                          const CoverageMap& map) {
  Observation now;
  now.time = frame.time;
  now.is_recording = true;
  now.brightness = frame.brightness;
  now.overexposed = frame.overexposed;
  now.motion = frame.motion;
  now.is_sharp = frame.focus.is_sharp;
  now.is_last_pass = is_last_pass_;
  if (frame.camera.known) {
    now.subject_motion = frame.camera.subject_motion;
    now.distance = frame.camera.subject_distance;
  }
  if (!place) return now;

  now.azimuth_rate = azimuth_rate(frame.time, place->place);
  if (place->is_closed) is_closed_[static_cast<std::size_t>(place->band)] = true;
  now.is_closed = place->is_closed;
  now.has_gap = now.is_closed && !map.gaps(place->band).empty();
  now.is_pass_complete = true;
  for (const Band band : bands_of(pass_)) {
    if (is_complete(band, map)) continue;
    now.is_pass_complete = false;
    // The first one is what a pass begins with.
    if (band != bands_of(pass_).front()) now.next = band;
    break;
  }
  return now;
}

Observation observe_idle(double time, const cv::Mat& bgr) {
  constexpr int side = 160;  // enough for the light
  constexpr double white = 250.0;
  const cv::Mat luma = reduced_luma(bgr, side);
  Observation now;
  now.time = time;
  now.brightness = cv::mean(luma)[0] / 255.0;
  now.overexposed = static_cast<double>(cv::countNonZero(luma >= white)) / static_cast<double>(luma.total());
  return now;
}

}  // namespace gyre
