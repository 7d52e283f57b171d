// SPDX-License-Identifier: Apache-2.0
// What the rig understands of a rendered person who turns before a camera that stands, on a turntable and on their own
// feet.
#include "common/parallel/parallel.h"
#include "device/coverage/turntable_angle.h"
#include "tests/device/session/rendered_rig.h"
#include "tests/synthetic/capture.h"

#include <gtest/gtest.h>
#include <algorithm>
#include <array>
#include <opencv2/core.hpp>
#include <ostream>
#include <random>
#include <vector>

namespace gyre {
namespace {

using synthetic::Capture;
using synthetic::CaptureOptions;
using synthetic::FrameTruth;
using test::Rig;

constexpr double degrees = 180.0 / M_PI;

struct Case {
  int frames;
  double sway_deg;
  std::uint64_t seed;
};

std::ostream& operator<<(std::ostream& out, const Case& c) {
  return out << c.seed;
}

Capture capture_of(const Case& c) {
  CaptureOptions options;
  options.sequence = synthetic::Sequence::turn;
  options.width = 180;
  options.height = 320;
  options.frames = c.frames;
  options.cell = 0.02;
  options.rush = false;
  options.samples = 2;
  options.defocus_px = 1.5;
  options.sway_deg = c.sway_deg;
  options.seed = c.seed;
  return make_capture(options);
}

// What a turntable's line brings: 20 samples a second of their own clock, in tenths of a degree, each some time late.
class Line {
 public:
  explicit Line(const Capture& capture) {
    constexpr double every = 0.05;
    std::mt19937 random(static_cast<std::uint32_t>(capture.options.seed));
    std::uniform_real_distribution<double> late(0.002, 0.03);
    // The table has spoken for a while when the pass begins.
    for (double time = 0.01 - 10 * every; time < capture.frames.back().time + 1.0; time += every) {
      const double tenths = std::round(10.0 * degrees * capture.trajectory.yaw(std::max(0.0, time)));
      samples_.push_back({time, time + late(random), std::remainder(0.1 * tenths / degrees, 2 * M_PI)});
    }
  }

  // Hands on all that have come.
  void bring(double now, TurntableAngle& table) {
    for (; next_ < samples_.size() && samples_[next_].comes <= now; ++next_)
      table.add(samples_[next_].time, samples_[next_].angle);
  }

 private:
  struct Sample {
    double time, comes, angle;
  };
  std::vector<Sample> samples_;
  std::size_t next_ = 0;
};

class RenderedTurn : public testing::TestWithParam<Case> {
 protected:
  void SetUp() override {
    capture_ = capture_of(GetParam());
    pictures_.resize(capture_.frames.size());
    parallel_for(pictures_.size(), 0,
                 [&](std::size_t i) { pictures_[i] = render_frame(capture_, static_cast<int>(i)); });
  }

  const FrameTruth& truth(std::size_t i) const { return capture_.frames[i]; }
  // The camera goes around the subject the other way.
  double azimuth(std::size_t i) const { return truth(0).subject_yaw - truth(i).subject_yaw; }

  // None of these happens.
  static void expect_no_alarm(const Guidance& guidance, std::size_t frame) {
    for (const Condition none :
         {Condition::camera_lost, Condition::no_subject, Condition::too_dark, Condition::too_bright,
          Condition::subject_moved, Condition::too_fast, Condition::too_close, Condition::too_far,
          Condition::direction_reversed, Condition::gap_behind, Condition::head_pass, Condition::next_ring}) {
      EXPECT_FALSE(guidance.is_raised(none)) << name_of(none) << " in frame " << frame;
    }
  }

  Capture capture_;
  std::vector<cv::Mat> pictures_;
};

TEST_P(RenderedTurn, IsFollowedByTheTurntable) {
  Rig rig("turn", capture_);
  Line line(capture_);
  TurntableAngle table;
  constexpr double way = 0.04;  // of a picture to the rig, seconds
  double worst = 0.0;
  std::optional<double> at_closure;
  std::size_t known = 0;
  for (std::size_t i = 0; i < pictures_.size(); ++i) {
    line.bring(truth(i).time + way, table);
    rig.add(pictures_[i], truth(i).time, table.at(truth(i).time));
    expect_no_alarm(rig.guidance(), i);
    if (!rig.place().place.known) continue;
    ++known;
    worst = std::max(worst, degrees * std::abs(rig.place().place.azimuth - azimuth(i)));
    if (rig.place().is_closed && !at_closure) at_closure = degrees * std::abs(azimuth(i));
  }
  EXPECT_LE(worst, 1.0);
  EXPECT_EQ(known, pictures_.size());
  ASSERT_TRUE(at_closure);
  EXPECT_NEAR(*at_closure, 360.0, 5.0);
  EXPECT_EQ(rig.map().share(Band::body_upper), 1.0);
  for (int s = 0; s < CoverageMap::sectors; ++s) {
    const CoverageCell& cell = rig.map().cell(Band::body_upper, s);
    EXPECT_FALSE(cell.is_covered() && truth(static_cast<std::size_t>(cell.best_frame)).defocused) << s;
  }
  // The table stands; a condition takes a moment.
  const double end = truth(pictures_.size() - 1).time;
  for (double time = end + 0.1; time < end + 0.5; time += 0.1) {
    line.bring(time + way, table);
    rig.add(pictures_.back(), time, table.at(time));
  }
  EXPECT_TRUE(rig.guidance().is_raised(Condition::done));
}

// Nothing is claimed then, and nobody is alarmed.
TEST_P(RenderedTurn, OnTheirOwnFeetHasNoPlace) {
  Rig rig("turn", capture_);
  for (std::size_t i = 0; i < pictures_.size(); ++i) {
    rig.add(pictures_[i], truth(i).time);
    expect_no_alarm(rig.guidance(), i);
    EXPECT_FALSE(rig.place().place.known || rig.place().is_closed);
  }
  EXPECT_EQ(rig.map().share(Band::body_upper), 0.0);
}

INSTANTIATE_TEST_SUITE_P(Turns, RenderedTurn,
                         testing::Values(Case{200, 0.0, 1}, Case{150, 1.0, 2}, Case{260, 1.0, 3}, Case{180, 0.0, 7},
                                         Case{220, 1.0, 8}, Case{160, 0.5, 9}));

}  // namespace
}  // namespace gyre
