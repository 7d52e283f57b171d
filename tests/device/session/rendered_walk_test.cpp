// SPDX-License-Identifier: Apache-2.0
// What the rig understands of a rendered person in a room, whose every frame is known exactly.
#include "common/parallel/parallel.h"
#include "tests/device/session/motion_script.h"
#include "tests/device/session/rendered_rig.h"
#include "tests/synthetic/capture.h"

#include <gtest/gtest.h>
#include <array>
#include <functional>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <ostream>
#include <random>
#include <string>
#include <vector>

namespace gyre {
namespace {

using synthetic::Capture;
using synthetic::CaptureOptions;
using synthetic::Sequence;
using test::Rig;

constexpr double degrees = 180.0 / M_PI;

CaptureOptions small_capture(Sequence sequence, int frames, std::uint64_t seed) {
  CaptureOptions options;
  options.sequence = sequence;
  options.width = 180;
  options.height = 320;
  options.frames = frames;
  options.cell = 0.02;
  options.stop = options.rush = false;
  options.seed = seed;
  return options;
}

// The same walk through the same room, where nobody stands.
Capture without_subject(Capture capture) {
  for (Eigen::Vector3d& vertex : capture.subject.mesh.vertices) vertex.y() -= 100.0;
  return capture;
}

std::vector<cv::Mat> rendered(const Capture& capture, const std::vector<int>& indices) {
  std::vector<cv::Mat> pictures(indices.size());
  parallel_for(indices.size(), 0, [&](std::size_t i) { pictures[i] = render_frame(capture, indices[i]); });
  return pictures;
}

std::vector<int> range(int begin, int end) {
  std::vector<int> indices;
  for (int i = begin; i < end; ++i) indices.push_back(i);
  return indices;
}

struct Case {
  Sequence sequence;
  const char* pass;
  int frames;
  std::uint64_t seed;
};

std::ostream& operator<<(std::ostream& out, const Case& c) {
  return out << c.pass << " " << c.seed;
}

class RenderedWalk : public testing::TestWithParam<Case> {};

TEST_P(RenderedWalk, IsFollowed) {
  const Case& c = GetParam();
  CaptureOptions options = small_capture(c.sequence, c.frames, c.seed);
  options.defocus_px = 1.5;
  options.stop = true;
  options.samples = 2;  // corners that flicker from pixel to pixel are not followed well
  const Capture capture = make_capture(options);
  const std::vector<cv::Mat> pictures = rendered(capture, range(0, c.frames));

  Rig rig(c.pass, capture);
  double azimuth = 0.0, last = 0.0, worst = 0.0, height = 0.0, lift = 0.0;
  std::optional<double> at_closure;
  int right_band = 0, subject_known = 0, subject_seen = 0;
  std::array<int, condition_count> raised{};
  for (int i = 0; i < c.frames; ++i) {
    const synthetic::FrameTruth& truth = capture.frames[static_cast<std::size_t>(i)];
    rig.add(pictures[static_cast<std::size_t>(i)]);
    const Eigen::Vector3d centre = centre_of(truth.cam_from_world);
    const double direction = std::atan2(centre.x(), centre.z());
    const double down = std::asin(-(truth.cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitZ()).y());
    if (i == 0) {
      height = centre.y();
      lift = down;
    } else {
      azimuth += std::remainder(direction - last, 2 * M_PI);
    }
    last = direction;
    const double error = degrees * std::abs(rig.place().place.azimuth - azimuth);
    worst = std::max(worst, error);
    if (rig.place().is_closed && !at_closure) at_closure = error;
    constexpr double border = 17.0 / degrees;
    const Band truly = c.sequence == Sequence::orbit_body
                           ? (centre.y() > height - 0.4 ? Band::body_upper : Band::body_lower)
                       : down - lift > border  ? Band::crown
                       : down - lift < -border ? Band::chin
                                               : Band::head_ring;
    if (truly == rig.place().band) ++right_band;
    if (rig.seen().has_subject) ++subject_known;
    if (rig.seen().has_subject == true) ++subject_seen;
    for (std::size_t k = 0; k < condition_count; ++k) raised[k] += rig.guidance().conditions()[k] ? 1 : 0;
  }
  EXPECT_LE(worst, 10.0);
  ASSERT_TRUE(at_closure);
  EXPECT_LE(*at_closure, 5.0);
  EXPECT_GE(right_band, 0.95 * c.frames);
  for (const Band band : all_bands) {
    for (int s = 0; s < CoverageMap::sectors; ++s) {
      const CoverageCell& cell = rig.map().cell(band, s);
      if (!cell.is_covered()) continue;
      EXPECT_FALSE(capture.frames[static_cast<std::size_t>(cell.best_frame)].defocused) << name_of(band) << " " << s;
    }
  }
  EXPECT_GE(subject_known, 0.8 * c.frames);
  EXPECT_GE(subject_seen, 0.99 * subject_known);
  for (const Condition none :
       {Condition::camera_lost, Condition::no_subject, Condition::too_dark, Condition::too_bright,
        Condition::subject_moved, Condition::too_fast, Condition::too_close, Condition::too_far}) {
    EXPECT_EQ(raised[static_cast<std::size_t>(none)], 0) << name_of(none);
  }
}

INSTANTIATE_TEST_SUITE_P(Passes, RenderedWalk,
                         testing::Values(Case{Sequence::orbit_body, "body", 320, 1},
                                         Case{Sequence::orbit_head, "head", 180, 2},
                                         Case{Sequence::orbit_head, "head", 180, 3}));

TEST(RenderedRoom, AWalkAroundNobodyHasNoSubject) {
  for (const Case& c : {Case{Sequence::orbit_body, "body", 320, 4}, Case{Sequence::orbit_head, "head", 180, 5}}) {
    SCOPED_TRACE(c.pass);
    const Capture capture = without_subject(make_capture(small_capture(c.sequence, c.frames, c.seed)));
    constexpr int frames = 90;
    const std::vector<cv::Mat> pictures = rendered(capture, range(0, frames));
    Rig rig(c.pass, capture);
    int known = 0, seen = 0;
    for (const cv::Mat& picture : pictures) {
      rig.add(picture);
      if (rig.seen().has_subject) ++known;
      if (rig.seen().has_subject == true) ++seen;
    }
    EXPECT_GE(known, 0.7 * frames);
    EXPECT_LE(seen, 0.02 * known);
    EXPECT_TRUE(rig.guidance().is_raised(Condition::no_subject));
  }
}

// A walk in which something goes wrong for two seconds.
class ScriptedWalk : public testing::Test {
 protected:
  static constexpr int clean = 60, trouble = 30, frames = 400;

  static const Capture& walk() {
    static const Capture capture = make_capture(small_capture(Sequence::orbit_body, frames, 6));
    return capture;
  }
  static const std::vector<cv::Mat>& pictures() {
    static const std::vector<cv::Mat> all = rendered(walk(), range(0, clean + 4 * trouble + clean));
    return all;
  }
  static const cv::Mat& picture(int at) { return pictures()[static_cast<std::size_t>(at)]; }

  // What is wrong, without what is told of the way.
  static constexpr std::size_t trouble_count = static_cast<std::size_t>(Condition::direction_reversed) + 1;
  static Conditions troubles(const Guidance& guidance) {
    return guidance.conditions() & Conditions((1U << trouble_count) - 1U);
  }

  // The walk, the trouble from `picture`, and the walk again from frame `after` on.
  static void play(Condition raises, const std::vector<cv::Mat>& wrong, int after,
                   const std::vector<Condition>& also = {}) {
    Rig rig("body", walk());
    const double interval = 1.0 / walk().options.fps;
    for (int i = 0; i < clean; ++i) {
      rig.add(picture(i));
      EXPECT_TRUE(troubles(rig.guidance()).none()) << i << ": " << rig.guidance().conditions();
    }
    int changes = 0;
    bool was = false;
    const auto note = [&] {
      const bool is = rig.guidance().is_raised(raises);
      changes += is != was ? 1 : 0;
      was = is;
    };
    double lasted = 0.0;
    for (const cv::Mat& one : wrong) {
      rig.add(one);
      lasted += interval;
      note();
      if (lasted > 0.5 + interval) {
        EXPECT_TRUE(rig.guidance().is_raised(raises)) << name_of(raises) << " after " << lasted;
      }
      for (std::size_t k = 0; k < trouble_count; ++k) {
        const auto other = static_cast<Condition>(k);
        const bool may = other == raises || std::find(also.begin(), also.end(), other) != also.end();
        EXPECT_TRUE(may || !rig.guidance().conditions()[k]) << name_of(other) << " after " << lasted;
      }
    }
    lasted = 0.0;
    for (int i = 0; i < clean; ++i) {
      rig.add(picture(after + i));
      lasted += interval;
      note();
      if (lasted > 1.0 + interval) {
        EXPECT_TRUE(troubles(rig.guidance()).none()) << rig.guidance().conditions() << " after " << lasted;
      }
    }
    EXPECT_EQ(changes, 2) << name_of(raises);
  }

  static std::vector<cv::Mat> changed(const std::function<void(cv::Mat&)>& change) {
    std::vector<cv::Mat> wrong;
    for (int i = 0; i < trouble; ++i) change(wrong.emplace_back(picture(clean + i).clone()));
    return wrong;
  }
};

TEST_F(ScriptedWalk, TheLightGoesOut) {
  // In the dark nothing can be told of the person, nor of how sharp the picture is.
  play(Condition::too_dark, changed([](cv::Mat& one) { one.convertTo(one, -1, 0.1); }), clean + trouble,
       {Condition::blurred, Condition::no_subject});
}

TEST_F(ScriptedWalk, ALampShinesIn) {
  play(Condition::too_bright, changed([](cv::Mat& one) { one(cv::Rect(0, 0, one.cols, one.rows / 2)).setTo(255); }),
       clean + trouble, {Condition::blurred, Condition::no_subject});
}

TEST_F(ScriptedWalk, TheFocusIsLost) {
  play(Condition::blurred, changed([](cv::Mat& one) { cv::GaussianBlur(one, one, {}, 2.5); }), clean + trouble);
}

TEST_F(ScriptedWalk, TheOperatorRuns) {
  std::vector<cv::Mat> wrong;
  for (int i = 0; i < trouble; ++i) wrong.push_back(picture(clean + 4 * i));
  play(Condition::too_fast, wrong, clean + 4 * trouble, {Condition::blurred});
}

TEST_F(ScriptedWalk, TheOperatorTurnsBack) {
  std::vector<cv::Mat> wrong;
  for (int i = 0; i < trouble; ++i) wrong.push_back(picture(clean - i));
  play(Condition::direction_reversed, wrong, clean - trouble);
}

TEST_F(ScriptedWalk, ThePersonLeavesAndComesBack) {
  const Capture nobody = without_subject(walk());
  play(Condition::no_subject, rendered(nobody, range(clean, clean + trouble)), clean + trouble);
}

// From when to when a condition has a cause, seconds.
struct Cause {
  Condition condition;
  double begin, end;
  bool must_be_told = true;
};

// The movement of half of the surface across the sight that has to be told, within half a second. Along the sight it
// may be.
constexpr double spoils = 0.05;  // metres

std::vector<Cause> causes_of(const Capture& capture, const Capture& still, const std::vector<test::Act>& acts,
                             int frames) {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  std::vector<Cause> causes;
  const auto first = [&](double from, const std::function<bool(int)>& is) {
    for (int i = 0; i < frames; ++i) {
      if (capture.frames[static_cast<std::size_t>(i)].time > from && is(i))
        return capture.frames[static_cast<std::size_t>(i)].time;
    }
    return infinite;
  };
  const auto depth = [](const Capture& one, int i) {
    return (one.frames[static_cast<std::size_t>(i)].cam_from_world * Eigen::Vector3d(0, 1.2, 0)).z();
  };
  const GuidanceOptions limits;
  for (const test::Act& act : acts) {
    if (test::is_of_person(act.deed)) {
      const double begin = first(act.begin, [&](int i) { return test::truly_moved(capture, i) >= spoils; });
      causes.push_back({Condition::subject_moved, begin, act.end(), begin < act.end()});
    } else {
      const bool is_near = act.amount < 1.0;
      const double begin = first(act.begin, [&](int i) {
        const double ratio = depth(capture, i) / depth(still, i);
        return is_near ? ratio < limits.close : ratio > limits.far;
      });
      causes.push_back({is_near ? Condition::too_close : Condition::too_far, begin, act.end()});
    }
  }
  return causes;
}

// A walk in which those acts happen, with a person who sways a little all the time.
void expect_told(Sequence sequence, std::uint64_t seed, const std::vector<test::Act>& acts, double seconds) {
  const bool is_body = sequence == Sequence::orbit_body;
  CaptureOptions options = small_capture(sequence, is_body ? 600 : 400, seed);
  options.sway_deg = 0.2;
  Capture still = make_capture(options);
  const synthetic::RoomSize room{4.4F, 4.6F, 2.9F};  // to step back in
  still.room = synthetic::make_room(seed, room);
  still.appearance = synthetic::Appearance(seed, 1.0, room);
  const Capture capture = test::with_acts(still, acts);
  const int frames = static_cast<int>(seconds * options.fps);
  const std::vector<cv::Mat> pictures = rendered(capture, range(0, frames));
  const std::vector<Cause> causes = causes_of(capture, still, acts, frames);

  Rig rig(is_body ? "body" : "head", capture);
  const double interval = 1.0 / options.fps;
  std::vector<double> raised_at(causes.size(), -1.0);
  Conditions before;
  for (int i = 0; i < frames; ++i) {
    const double time = capture.frames[static_cast<std::size_t>(i)].time;
    rig.add(pictures[static_cast<std::size_t>(i)]);
    const Conditions now = rig.guidance().conditions();
    for (const Condition condition : {Condition::no_subject, Condition::subject_moved, Condition::too_fast,
                                      Condition::too_close, Condition::too_far, Condition::direction_reversed}) {
      const auto k = static_cast<std::size_t>(condition);
      bool may = false;
      for (std::size_t c = 0; c < causes.size(); ++c) {
        if (causes[c].condition != condition) continue;
        const double clear = causes[c].must_be_told ? 1.0 : 2.0;
        const bool is_due = time > acts[c].begin && time < causes[c].end + clear + interval;
        may = may || is_due;
        if (!causes[c].must_be_told || !is_due || !now[k] || before[k]) continue;
        EXPECT_LT(raised_at[c], 0.0) << name_of(condition) << " flickers at " << time;
        if (raised_at[c] < 0.0) raised_at[c] = time;
      }
      EXPECT_TRUE(may || !now[k]) << name_of(condition) << " at " << time << " motion "
                                  << rig.seen().subject_motion.value_or(-1) << " distance "
                                  << rig.seen().distance.value_or(-1);
    }
    before = now;
  }
  for (std::size_t c = 0; c < causes.size(); ++c) {
    if (!causes[c].must_be_told) continue;
    EXPECT_GE(raised_at[c], 0.0) << name_of(causes[c].condition) << " from " << causes[c].begin;
    EXPECT_LE(raised_at[c], causes[c].begin + 0.5 + interval) << name_of(causes[c].condition);
  }
}

TEST(RenderedActs, ThePersonLeans) {
  expect_told(Sequence::orbit_body, 6, {{test::Deed::lean, 3.0, 0.8, -1.0, 0.1, 0.7}}, 6.5);
}

TEST(RenderedActs, ThePersonStepsAside) {
  expect_told(Sequence::orbit_body, 6, {{test::Deed::step, 3.0, 0.8, -1.0, 0.15, 0.7}}, 6.5);
}

TEST(RenderedActs, TheOperatorStepsNearer) {
  expect_told(Sequence::orbit_body, 6, {{test::Deed::approach, 3.0, 1.0, 6.0, 0.6, 0.0}}, 14.0);
  expect_told(Sequence::orbit_head, 3, {{test::Deed::approach, 3.0, 1.0, 2.0, 0.6, 0.0}}, 9.0);
}

TEST(RenderedActs, TheOperatorStepsAway) {
  expect_told(Sequence::orbit_body, 6, {{test::Deed::approach, 3.0, 1.0, 6.0, 1.65, 0.0}}, 14.0);
  expect_told(Sequence::orbit_head, 3, {{test::Deed::approach, 3.0, 1.0, 2.0, 1.65, 0.0}}, 9.0);
}

// Random scripts: who moves, how, how far and where to.
class RandomActs : public testing::TestWithParam<std::uint64_t> {};

TEST_P(RandomActs, EachIsToldInTimeAndNothingElse) {
  std::mt19937_64 random(GetParam());
  const auto uniform = [&](double from, double to) {
    return from + (to - from) * static_cast<double>(random() >> 11U) / static_cast<double>(1ULL << 53U);
  };
  std::vector<test::Act> acts;
  double time = uniform(2.5, 4.0);
  for (int k = 0; k < 3; ++k) {
    test::Act act;
    act.begin = time;
    act.direction = uniform(0.0, 2 * M_PI);
    switch (random() % 4) {
      case 0:
        act.deed = test::Deed::lean;
        act.amount = uniform(0.09, 0.13);
        break;
      case 1:
        act.deed = test::Deed::step;
        act.amount = uniform(0.12, 0.20);
        break;
      default:
        act.deed = test::Deed::approach;
        act.amount = random() % 2 == 0 ? uniform(0.55, 0.62) : uniform(1.6, 1.75);
        act.rise = uniform(0.9, 1.2);
        act.hold = uniform(1.0, 3.0);
        break;
    }
    acts.push_back(act);
    time = act.end() + uniform(2.0, 3.5);
  }
  expect_told(Sequence::orbit_body, GetParam(), acts, time);
}

INSTANTIATE_TEST_SUITE_P(Seeds, RandomActs, testing::Range<std::uint64_t>(11, 41));

}  // namespace
}  // namespace gyre
