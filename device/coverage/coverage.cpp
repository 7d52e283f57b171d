// SPDX-License-Identifier: Apache-2.0
#include "device/coverage/coverage.h"

#include <cmath>

namespace gyre {

namespace {

bool is_ring(Band band) {
  return band != Band::crown && band != Band::chin;
}

}  // namespace

// Looks for the ring's start, from a little before the full turn on, until it is found.
void Coverage::look_for_start(Start& start, const FrameReading& frame, const cv::Mat& luma, CoverageReading& reading) {
  constexpr double early = 0.5, late = 0.7;  // radians
  constexpr int every = 3;                   // frames: looking costs as much as all the rest
  const double way = std::abs(reading.place.azimuth - start.mark.azimuth);
  if (start.is_closed || way < 2 * M_PI - early || way > 2 * M_PI + late) return;
  if (!frame.focus.is_sharp || ++frames_since_look_ < every) return;
  frames_since_look_ = 0;
  const std::optional<Eigen::Quaterniond> turn = start.view.turn_to(luma);
  if (!turn) {
    start.seen_drift.reset();
    return;
  }
  // One look may take a chair for another; two in a row that tell the same drift do not.
  constexpr double same = 0.05;
  const double drift = orbit_.drift(start.mark, *turn);
  const bool is_confirmed = start.seen_drift && std::abs(drift - *start.seen_drift) < same;
  start.seen_drift = drift;
  if (!is_confirmed) return;
  orbit_.correct(start.mark, *turn);
  start.seen_drift.reset();
  reading.place.azimuth = orbit_.mark().azimuth;
  constexpr double nearly = 0.1;  // radians short of the full turn
  start.is_closed = std::abs(reading.place.azimuth - start.mark.azimuth) > 2 * M_PI - nearly;
}

CoverageReading Coverage::turned(const FrameReading& frame, std::optional<double> turntable) {
  CoverageReading reading;
  reading.band = bands_of(pass_).front();
  reading.place.known = turntable.has_value();
  if (turntable) {
    if (!turntable_start_) turntable_start_ = turntable;
    // The camera goes around the subject the other way.
    turned_ = *turntable_start_ - *turntable;
    map_.add(turned_, reading.band, frame.focus.sharpness, frame.focus.is_sharp, frame.index);
  }
  reading.place.azimuth = turned_;
  constexpr double rounding = 0.01;  // of the table's angle, radians
  reading.is_closed = std::abs(turned_) >= 2 * M_PI - rounding;
  return reading;
}

CoverageReading Coverage::add(const FrameReading& frame, const cv::Mat& luma, std::optional<double> turntable) {
  if (pass_ == "turn") return turned(frame, turntable);
  CoverageReading reading;
  reading.place = orbit_.add(frame.camera);
  reading.band = band_of(pass_, reading.place, band_);
  std::optional<Start>& start = starts_[static_cast<std::size_t>(reading.band)];
  if (is_ring(reading.band)) {
    if (!start) start.emplace(Start{RememberedView(camera_, luma), orbit_.mark(), std::nullopt, false});
    look_for_start(*start, frame, luma, reading);
    reading.is_closed = start->is_closed;
  }
  band_ = reading.band;
  const bool is_sharp = frame.focus.is_sharp && reading.place.known;
  map_.add(reading.place.azimuth, reading.band, frame.focus.sharpness, is_sharp, frame.index);
  return reading;
}

}  // namespace gyre
