// SPDX-License-Identifier: Apache-2.0
#include "device/session/observer.h"

#include <gtest/gtest.h>
#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

namespace gyre {
namespace {

// A walk around the subject as its readings.
class Walk {
 public:
  Walk(const std::string& pass, bool is_last) : observer_(pass, is_last) {}

  // Goes to that azimuth (degrees) in that band, sharply, and tells what was observed last. is_closed: of the ring.
  Observation go(double degrees, Band band, bool is_closed = false, bool is_sharp = true) {
    const double step = degrees > at_ ? 2.0 : -2.0;
    Observation last;
    while (std::abs(degrees - at_) > 1.0) {
      at_ += step;
      time_ += 1.0 / 30.0;
      FrameReading frame;
      frame.index = index_++;
      frame.time = time_;
      frame.focus.is_sharp = is_sharp;
      CoverageReading place;
      place.place.azimuth = at_ * M_PI / 180.0;
      place.band = band;
      place.is_closed = is_closed;
      map_.add(place.place.azimuth, band, 1.0, is_sharp, frame.index);
      last = observer_.add(frame, place, map_);
    }
    return last;
  }

 private:
  Observer observer_;
  CoverageMap map_;
  double at_ = 0.0, time_ = 0.0;
  int index_ = 0;
};

TEST(Observer, ABodyPassNeedsBothRings) {
  Walk walk("body", false);
  Observation now = walk.go(358.0, Band::body_upper);
  EXPECT_FALSE(now.next);
  EXPECT_FALSE(now.is_closed);
  EXPECT_NEAR(*now.azimuth_rate, 60.0 * M_PI / 180.0, 0.05);
  now = walk.go(362.0, Band::body_upper, true);
  EXPECT_TRUE(now.is_closed);
  EXPECT_FALSE(now.azimuth_rate);  // the ring is walked, whichever way it goes on
  EXPECT_FALSE(now.has_gap);
  EXPECT_EQ(now.next, Band::body_lower);
  EXPECT_FALSE(now.is_pass_complete);
  now = walk.go(720.0, Band::body_lower);
  EXPECT_FALSE(now.is_pass_complete);
  now = walk.go(724.0, Band::body_lower, true);
  EXPECT_TRUE(now.is_pass_complete);
  EXPECT_FALSE(now.is_last_pass);
  EXPECT_FALSE(now.next);
}

TEST(Observer, AGapIsToldWhenTheRingIsClosedAndNotBefore) {
  Walk walk("body", false);
  walk.go(90.0, Band::body_upper);
  EXPECT_FALSE(walk.go(150.0, Band::body_upper, false, false).has_gap);
  walk.go(358.0, Band::body_upper);
  Observation now = walk.go(362.0, Band::body_upper, true);
  EXPECT_TRUE(now.has_gap);
  EXPECT_FALSE(now.next);
  now = walk.go(515.0, Band::body_upper, true);
  EXPECT_FALSE(now.has_gap);
  EXPECT_EQ(now.next, Band::body_lower);
}

TEST(Observer, AHeadPassGoesFromTheRingToCrownAndChin) {
  Walk walk("head", true);
  walk.go(358.0, Band::head_ring);
  EXPECT_EQ(walk.go(362.0, Band::head_ring, true).next, Band::crown);
  EXPECT_EQ(walk.go(366.0, Band::crown).next, Band::crown);
  EXPECT_EQ(walk.go(380.0, Band::crown).next, Band::chin);
  const Observation now = walk.go(400.0, Band::chin);
  EXPECT_FALSE(now.next);
  EXPECT_TRUE(now.is_pass_complete);
  EXPECT_TRUE(now.is_last_pass);
}

TEST(Observer, TheWayBackHasANegativeRateWhicheverWayThePassGoes) {
  for (const double way : {1.0, -1.0}) {
    Walk walk("body", false);
    EXPECT_GT(*walk.go(way * 90.0, Band::body_upper).azimuth_rate, 0.5);
    EXPECT_LT(*walk.go(way * 30.0, Band::body_upper).azimuth_rate, -0.5);
  }
  Walk begun("body", false);
  EXPECT_FALSE(begun.go(10.0, Band::body_upper).azimuth_rate);
}

TEST(Observer, WithoutAPlaceOnlyThePictureIsTold) {
  Observer observer("turn", true);
  FrameReading frame;
  frame.brightness = 0.3;
  frame.motion = 0.7;
  const Observation now = observer.add(frame, std::nullopt, {});
  EXPECT_EQ(now.brightness, 0.3);
  EXPECT_EQ(now.motion, 0.7);
  EXPECT_FALSE(now.azimuth_rate);
  EXPECT_FALSE(now.is_pass_complete);
}

TEST(Observer, OfATurnOnOwnFeetNothingIsToldThatOnlyAWalkTells) {
  Observer observer("turn", true);
  FrameReading frame;
  frame.camera.subject_motion = 9.0;
  frame.camera.subject_share = 0.0;
  CoverageReading place;
  place.place.known = false;
  for (int i = 0; i < 60; ++i) {
    frame.time = i / 30.0;
    frame.camera.subject_distance = 1.0 + i;
    const Observation now = observer.add(frame, place, {});
    EXPECT_TRUE(now.is_turn);
    EXPECT_FALSE(now.subject_motion || now.has_subject || now.distance || now.azimuth_rate);
    EXPECT_FALSE(now.is_closed || now.is_pass_complete || now.has_gap);
  }
}

TEST(Observer, WhileIdleTheLightIsTold) {
  const Observation dark = observe_idle(1.0, cv::Mat(90, 160, CV_8UC3, cv::Scalar::all(10)));
  EXPECT_NEAR(*dark.brightness, 10.0 / 255.0, 0.005);
  EXPECT_EQ(dark.overexposed, 0.0);
  EXPECT_FALSE(dark.is_recording);
  EXPECT_EQ(observe_idle(1.0, cv::Mat(90, 160, CV_8UC3, cv::Scalar::all(255))).overexposed, 1.0);
}

// Distances of frames, 30 a second, as guidance gets them.
class Steps {
 public:
  // Goes to that distance within that time and returns the least and the largest that was observed.
  std::pair<double, double> go(double distance, double seconds) {
    std::pair<double, double> seen{1e9, 0.0};
    const int frames = static_cast<int>(30 * seconds);
    const double from = distance_;
    for (int i = 1; i <= frames; ++i) {
      FrameReading frame;
      frame.time = time_ += 1.0 / 30.0;
      distance_ = from * std::pow(distance / from, static_cast<double>(i) / frames);
      frame.camera.log_distance = std::log(distance_);
      const std::optional<double> told = observer_.add(frame, std::nullopt, map_).distance;
      if (!told) continue;
      seen.first = std::min(seen.first, *told);
      seen.second = std::max(seen.second, *told);
    }
    return seen;
  }
  void jump(double distance) { distance_ = distance; }

 private:
  Observer observer_{"body", true};
  CoverageMap map_;
  double time_ = 0.0, distance_ = 1.0;
};

TEST(Observer, AStepNearerIsSeenAndASlidingUnitIsNot) {
  const GuidanceOptions limits;
  Steps steps;
  auto [least, largest] = steps.go(1.0, 5.0);
  EXPECT_DOUBLE_EQ(least, 1.0);
  EXPECT_DOUBLE_EQ(largest, 1.0);
  std::tie(least, largest) = steps.go(0.4, 20.0);
  EXPECT_GT(least, limits.no_longer_close);
  std::tie(least, largest) = steps.go(0.2, 1.0);
  EXPECT_LT(least, limits.close);
  // Who stays there is told so, and is not told to be far away when back.
  std::tie(least, largest) = steps.go(0.2, 10.0);
  EXPECT_LT(largest, limits.no_longer_close);
  std::tie(least, largest) = steps.go(0.4, 1.0);
  EXPECT_LT(largest, limits.no_longer_far);
  std::tie(least, largest) = steps.go(0.4, 10.0);
  EXPECT_GT(least, limits.no_longer_close);
  std::tie(least, largest) = steps.go(0.8, 1.0);
  EXPECT_GT(largest, limits.far);
  // Other points: not even somebody who runs.
  steps.jump(5.0);
  std::tie(least, largest) = steps.go(5.0, 5.0);
  EXPECT_DOUBLE_EQ(least, 1.0);
  EXPECT_DOUBLE_EQ(largest, 1.0);
}

}  // namespace
}  // namespace gyre
