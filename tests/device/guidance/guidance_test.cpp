// SPDX-License-Identifier: Apache-2.0
#include "device/guidance/guidance.h"

#include <gtest/gtest.h>
#include <functional>
#include <map>
#include <random>
#include <set>
#include <vector>

namespace gyre {
namespace {

Observation fine(double time) {
  Observation now;
  now.time = time;
  now.is_recording = true;
  now.has_subject = true;
  now.brightness = 0.45;
  now.overexposed = 0.01;
  now.motion = 0.4;
  now.is_sharp = true;
  now.subject_motion = 1.0;
  now.distance = 1.0;
  now.azimuth_rate = 0.4;
  return now;
}

using Trouble = std::function<void(Observation&)>;

// One way to cause each condition.
const std::map<Condition, Trouble>& troubles() {
  static const std::map<Condition, Trouble> all = {
      {Condition::camera_lost, [](Observation& now) { now.has_camera = false; }},
      {Condition::disk_low, [](Observation& now) { now.has_disk = false; }},
      {Condition::host_gone, [](Observation& now) { now.has_host = false; }},
      {Condition::no_subject, [](Observation& now) { now.has_subject = false; }},
      {Condition::too_dark, [](Observation& now) { now.brightness = 0.05; }},
      {Condition::too_bright, [](Observation& now) { now.overexposed = 0.5; }},
      {Condition::subject_moved, [](Observation& now) { now.subject_motion = 9.0; }},
      {Condition::too_fast, [](Observation& now) { now.motion = 2.0; }},
      {Condition::blurred, [](Observation& now) { now.is_sharp = false; }},
      {Condition::too_close, [](Observation& now) { now.distance = 0.5; }},
      {Condition::too_far, [](Observation& now) { now.distance = 2.0; }},
      {Condition::direction_reversed, [](Observation& now) { now.azimuth_rate = -0.4; }},
      {Condition::gap_behind, [](Observation& now) { now.is_closed = now.has_gap = true; }},
      {Condition::next_ring,
       [](Observation& now) {
         now.is_closed = true;
         now.next = Band::body_lower;
       }},
      {Condition::crown, [](Observation& now) { now.next = Band::crown; }},
      {Condition::chin, [](Observation& now) { now.next = Band::chin; }},
      {Condition::head_pass, [](Observation& now) { now.is_pass_complete = true; }},
      {Condition::done, [](Observation& now) { now.is_pass_complete = now.is_last_pass = true; }},
  };
  return all;
}

TEST(Guidance, EveryConditionIsRaisedWithinHalfASecondAndClearedWithinOne) {
  for (const double interval : {1.0 / 30.0, 1.0 / 14.0, 1.0 / 10.0}) {
    for (const auto& [condition, trouble] : troubles()) {
      SCOPED_TRACE(std::string(name_of(condition)));
      Guidance guidance;
      double time = 0.0;
      for (; time < 2.0; time += interval) EXPECT_TRUE(guidance.update(fine(time)).none());
      const double began = time;
      for (; time < began + 3.0; time += interval) {
        Observation now = fine(time);
        trouble(now);
        guidance.update(now);
        EXPECT_TRUE(time < began + 0.5 || guidance.is_raised(condition)) << time - began;
      }
      const double ended = time;
      for (; time < ended + 3.0; time += interval) {
        guidance.update(fine(time));
        EXPECT_TRUE(time < ended + 1.0 || !guidance.is_raised(condition)) << time - ended;
      }
      EXPECT_TRUE(guidance.conditions().none());
    }
  }
}

// Random scripts of troubles that come and go, some too short to matter, with noise on every value.
TEST(Guidance, NothingFlickersNothingIsRaisedWithoutCauseNothingIsMissed) {
  for (unsigned seed = 1; seed <= 60; ++seed) {
    std::mt19937 random(seed);
    const auto uniform = [&](double from, double to) {
      return from + (to - from) * static_cast<double>(random()) / static_cast<double>(std::mt19937::max());
    };
    Guidance guidance;
    std::map<Condition, double> until;
    std::map<Condition, double> caused_since, quiet_since, last_change;
    Conditions before;
    double camera_since = -10.0;
    const double interval = uniform(1.0 / 30.0, 0.1);
    for (double time = 0.0; time < 60.0; time += interval) {
      Observation now = fine(time);
      now.brightness = uniform(0.3, 0.6);
      now.motion = uniform(0.1, 0.8);
      now.subject_motion = uniform(0.0, 1.6);
      now.distance = uniform(0.85, 1.25);
      now.azimuth_rate = uniform(0.0, 0.6);
      std::set<Condition> caused;
      for (const auto& [condition, trouble] : troubles()) {
        if (!until.contains(condition) && uniform(0, 1) < 0.01) until[condition] = time + uniform(0.05, 4.0);
        if (!until.contains(condition)) continue;
        if (until[condition] < time) {
          until.erase(condition);
          continue;
        }
        caused.insert(condition);
      }
      for (const Condition condition : caused) troubles().at(condition)(now);
      guidance.update(now);

      for (const auto& [condition, trouble] : troubles()) {
        const auto index = static_cast<std::size_t>(condition);
        const bool is = guidance.is_raised(condition);
        if (caused.contains(condition)) {
          caused_since.try_emplace(condition, time);
          quiet_since.erase(condition);
        } else {
          quiet_since.try_emplace(condition, time);
          caused_since.erase(condition);
        }
        if (is == before[index]) continue;
        if (last_change.contains(condition)) {
          EXPECT_GE(time - last_change[condition], 0.25 - 1e-9) << name_of(condition) << " flickers, seed " << seed;
        }
        last_change[condition] = time;
        // Nothing is raised that was not caused for a while. (next_ring, gap_behind and done share their inputs.)
        const bool shares = condition == Condition::gap_behind || condition == Condition::next_ring ||
                            condition == Condition::done || condition == Condition::head_pass ||
                            condition == Condition::crown || condition == Condition::chin;
        if (is && !shares) {
          ASSERT_TRUE(caused_since.contains(condition)) << name_of(condition) << ", seed " << seed;
          EXPECT_GE(time - caused_since[condition], 0.25 - 1e-9) << name_of(condition);
        }
      }
      before = guidance.conditions();
      // Without a camera nothing is known of the rest, and of haste nothing is told twice.
      std::vector<Condition> always = {Condition::camera_lost, Condition::disk_low, Condition::host_gone};
      camera_since = caused.contains(Condition::camera_lost) ? time : camera_since;
      if (time - camera_since > 1.5) {
        for (const Condition one : {Condition::no_subject, Condition::too_dark, Condition::too_bright,
                                    Condition::subject_moved, Condition::too_fast, Condition::direction_reversed})
          always.push_back(one);
      }
      // The signal is that of the most severe.
      for (std::size_t i = 0; i < condition_count; ++i) {
        if (!before[i]) continue;
        EXPECT_EQ(guidance.signal(), signal_of(static_cast<Condition>(i)));
        break;
      }
      for (const Condition condition : always) {
        if (caused_since.contains(condition) && time - caused_since[condition] >= 0.5) {
          EXPECT_TRUE(guidance.is_raised(condition)) << name_of(condition) << ", seed " << seed;
        }
        if (quiet_since.contains(condition) && time - quiet_since[condition] >= 1.0) {
          EXPECT_FALSE(guidance.is_raised(condition)) << name_of(condition) << ", seed " << seed;
        }
      }
    }
  }
}

TEST(Guidance, ValuesBetweenTheBordersChangeNothing) {
  Guidance guidance;
  std::mt19937 random(3);
  for (double time = 0.0; time < 20.0; time += 0.033) {
    Observation now = fine(time);
    now.motion = 0.86 + 0.2 * static_cast<double>(random() % 100) / 100.0;  // between 0.85 and 1.1
    EXPECT_TRUE(guidance.update(now).none());
  }
  Observation fast = fine(20.0);
  fast.motion = 1.2;
  for (; fast.time < 21.0; fast.time += 0.033) guidance.update(fast);
  for (double time = 21.0; time < 40.0; time += 0.033) {
    Observation now = fine(time);
    now.motion = 0.86 + 0.2 * static_cast<double>(random() % 100) / 100.0;
    guidance.update(now);
    EXPECT_TRUE(guidance.is_raised(Condition::too_fast));
  }
}

TEST(Guidance, OneSignalTheMostSevere) {
  Guidance guidance;
  EXPECT_EQ(guidance.signal().sentence, "Ready: press the button to start.");
  Observation now = fine(0.0);
  guidance.update(now);
  EXPECT_EQ(guidance.signal().colour, Colour::green);
  for (; now.time < 1.0; now.time += 0.05) {
    now.motion = 3.0;
    now.brightness = 0.01;
    now.has_host = false;
    guidance.update(now);
  }
  EXPECT_EQ(guidance.conditions().count(), 3U);
  EXPECT_EQ(guidance.signal(), signal_of(Condition::too_dark));
  for (; now.time < 2.0; now.time += 0.05) {
    now.has_camera = false;
    guidance.update(now);
  }
  EXPECT_EQ(guidance.signal(), signal_of(Condition::camera_lost));
}

TEST(Guidance, SignalsCanBeToldApart) {
  for (std::size_t a = 0; a < condition_count; ++a) {
    const Signal one = signal_of(static_cast<Condition>(a));
    EXPECT_FALSE(one.sentence.empty());
    EXPECT_EQ(one.sentence.find('.'), one.sentence.size() - 1) << "one sentence: " << one.sentence;
    for (std::size_t b = 0; b < a; ++b) {
      const Signal other = signal_of(static_cast<Condition>(b));
      EXPECT_NE(one.sentence, other.sentence);
      EXPECT_FALSE(one.colour == other.colour && one.pattern == other.pattern && one.tone == other.tone)
          << one.sentence << " / " << other.sentence;
    }
  }
}

TEST(Guidance, InATurnNobodyIsToldToWalk) {
  for (std::size_t i = 0; i < condition_count; ++i) {
    const auto condition = static_cast<Condition>(i);
    const Signal turn = signal_of(condition, true);
    EXPECT_EQ(turn.colour, signal_of(condition).colour);
    // These are not raised in a turn.
    if (condition == Condition::next_ring) continue;
    EXPECT_EQ(turn.sentence.find("walk"), std::string_view::npos) << turn.sentence;
  }
  Guidance guidance;
  Observation now = fine(0.0);
  now.is_turn = true;
  guidance.update(now);
  EXPECT_EQ(guidance.signal().sentence, "Recording: turn on slowly.");
  for (; now.time < 1.0; now.time += 0.05) {
    now.azimuth_rate = 3.0;
    guidance.update(now);
  }
  EXPECT_EQ(guidance.signal(), signal_of(Condition::too_fast, true));
}

TEST(Guidance, AClosedRingIsAnnouncedForAWhile) {
  Guidance guidance;
  double time = 0.0;
  for (; time < 1.0; time += 0.05) {
    Observation now = fine(time);
    now.is_closed = true;
    guidance.update(now);
  }
  EXPECT_TRUE(guidance.is_raised(Condition::ring_closed));
  for (; time < 4.0; time += 0.05) {
    Observation now = fine(time);
    now.is_closed = true;
    guidance.update(now);
  }
  EXPECT_FALSE(guidance.is_raised(Condition::ring_closed));
}

}  // namespace
}  // namespace gyre
