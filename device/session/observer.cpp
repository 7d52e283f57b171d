// SPDX-License-Identifier: Apache-2.0
#include "device/session/observer.h"

#include "common/selection/measure.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

namespace gyre {

namespace {

bool is_ring(Band band) {
  return band != Band::crown && band != Band::chin;
}

}  // namespace

// Over a third of a second; positive in the direction of the whole way, once that is long enough to tell.
std::optional<double> Observer::azimuth_rate(double time, const OrbitPlace& place) {
  constexpr double span = 0.33;  // seconds
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

// The distance against the usual one. What is measured slides slowly, and as slowly the usual one follows it: somebody
// who stays too close is told so for a while, and a slide is never told.
std::optional<double> Observer::approach(double time, const CameraMotion& camera) {
  constexpr double slide = 0.035;      // change of the logarithm a second, ...
  constexpr double slide_away = 0.01;  // ... and while it is far from the usual one, ...
  constexpr double away = 0.24;        // ... from there on
  constexpr double fastest = 1.5;      // that somebody can walk, ...
  constexpr double noise = 0.05;       // ... and of one measurement
  if (!camera.known) {
    usual_.reset();
    return std::nullopt;
  }
  const double passed = time - distance_time_;
  // Faster: other points are taken for the subject.
  const bool jumps = std::abs(camera.log_distance - log_distance_) > fastest * passed + noise;
  if (!usual_ || jumps) usual_ = camera.log_distance;
  const double gap = camera.log_distance - *usual_;
  const double most = passed * (std::abs(gap) > away ? slide_away : slide);
  *usual_ += std::clamp(gap, -most, most);
  log_distance_ = camera.log_distance;
  distance_time_ = time;
  return std::exp(camera.log_distance - *usual_);
}

// Points of the subject come and go with what can be followed on it; of an empty middle there are none.
std::optional<bool> Observer::subject(double time, const CameraMotion& camera) {
  constexpr double gone = 0.05, back = 0.12;  // shares of the points in the middle
  constexpr double memory = 1.0;              // seconds
  if (camera.subject_share) {
    has_subject_ = *camera.subject_share >= (has_subject_.value_or(true) ? gone : back);
    subject_seen_at_ = time;
  } else if (time - subject_seen_at_ > memory) {
    has_subject_.reset();
  }
  return has_subject_;
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
  now.is_turn = pass_ == "turn";
  // Who turns moves by themselves, and a camera that stands tells neither how far away they are nor that nobody is
  // there.
  if (!now.is_turn) {
    if (frame.camera.known) now.subject_motion = frame.camera.subject_motion;
    now.distance = approach(frame.time, frame.camera);
    now.has_subject = subject(frame.time, frame.camera);
  }
  if (!place) return now;

  if (place->is_closed) is_closed_[static_cast<std::size_t>(place->band)] = true;
  const std::optional<double> rate = azimuth_rate(frame.time, place->place);
  // Above and below the head, and once a ring is walked, any way is as good.
  if (is_ring(place->band) && !is_closed_[static_cast<std::size_t>(place->band)]) now.azimuth_rate = rate;
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
