// SPDX-License-Identifier: Apache-2.0
#include "common/selection/selection.h"

#include <gtest/gtest.h>
#include <numeric>
#include <random>

namespace gyre {
namespace {

std::vector<FrameMeasure> uniform(int frames, double motion = 2.0, double sharpness = 100.0) {
  std::vector<FrameMeasure> out(static_cast<std::size_t>(frames), {motion, sharpness});
  out.front().motion = 0.0;
  return out;
}

SelectionOptions options_for(int keyframes) {
  SelectionOptions options;
  options.keyframes = keyframes;
  return options;
}

Selection select(const std::vector<FrameMeasure>& frames, const SelectionOptions& options) {
  Result<Selection> selection = select_keyframes(frames, options);
  if (!selection) ADD_FAILURE() << selection.error().message();
  return selection ? std::move(*selection) : Selection{};
}

// A walk around somebody, with changes of speed, stops, blur and noise.
std::vector<FrameMeasure> random_recording(std::uint32_t seed, int frames) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise;
  std::uniform_real_distribution<double> uniform01;
  std::vector<FrameMeasure> out;
  double speed = 1.0;
  int stopped = 0;
  int unsharp = 0;
  for (int i = 0; i < frames; ++i) {
    speed = std::clamp(speed + 0.1 * noise(random) + 0.05 * (1.0 - speed), 0.3, 2.5);
    if (uniform01(random) < 0.01) stopped = 15;
    if (uniform01(random) < 0.01) unsharp = 8;
    const double motion = stopped-- > 0 ? 0.05 : speed;
    const double sharpness = (unsharp-- > 0 ? 30.0 : 500.0) * std::exp(0.1 * noise(random));
    out.push_back({i == 0 ? 0.0 : motion, sharpness});
  }
  return out;
}

TEST(Smooth, KeepsAConstantAndTheEnds) {
  const std::vector<double> constant(20, 3.0);
  for (const double value : smooth(constant, 2.0)) EXPECT_DOUBLE_EQ(value, 3.0);
}

TEST(Smooth, IsAGaussian) {
  std::vector<double> impulse(41, 0.0);
  impulse[20] = 1.0;
  const std::vector<double> out = smooth(impulse, 2.0);
  EXPECT_NEAR(std::accumulate(out.begin(), out.end(), 0.0), 1.0, 1e-12);
  EXPECT_NEAR(out[22] / out[20], std::exp(-0.5), 1e-12);
  EXPECT_EQ(out[20 + 9], 0.0) << "cut at four sigma";
}

TEST(Selection, UniformMotionTakesEveryFourthFrame) {
  const Selection selection = select(uniform(301), options_for(75));
  ASSERT_EQ(selection.keyframes.size(), 75U);
  for (int i = 0; i < 75; ++i) EXPECT_EQ(selection.keyframes[static_cast<std::size_t>(i)], 4 * i);
  EXPECT_DOUBLE_EQ(selection.threshold, 8.0);
  EXPECT_NEAR(selection.widest_gap, 1.0, 1e-9);
}

TEST(Selection, CarriesTheOvershoot) {
  // 10.7 frames to a keyframe: without the carry the rounding up would lose keyframes on the way.
  const Selection selection = select(uniform(1071), options_for(100));
  ASSERT_EQ(selection.keyframes.size(), 100U);
  const std::vector<double> travelled = [] {
    std::vector<double> t(1071);
    for (std::size_t i = 0; i < t.size(); ++i) t[i] = static_cast<double>(i);
    return t;
  }();
  const Walk walked = walk(travelled, uniform(1071), 10.7, 0, 100, options_for(100));
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(walked.crossings[static_cast<std::size_t>(i)], static_cast<int>(std::ceil(10.7 * i - 1e-6)));
  }
}

TEST(Selection, DoesNotDependOnTheUnitOfMotion) {
  std::vector<FrameMeasure> frames = random_recording(3, 600);
  const Selection before = select(frames, options_for(75));
  for (FrameMeasure& frame : frames) frame.motion *= 8.0;
  EXPECT_EQ(select(frames, options_for(75)).keyframes, before.keyframes);
}

TEST(Selection, TakesTheSharpestOfTheNeighbourhood) {
  std::vector<FrameMeasure> frames = uniform(1001);  // a keyframe every 20 frames
  frames[103].sharpness = 101.0;
  frames[96].sharpness = 105.0;
  frames[94].sharpness = 200.0;  // six frames away
  const Selection selection = select(frames, options_for(50));
  EXPECT_EQ(selection.keyframes[4], 80);
  EXPECT_EQ(selection.keyframes[5], 96);
  EXPECT_EQ(selection.keyframes[6], 120);
  EXPECT_EQ(selection.neighbourhoods[5].front(), 95);
  EXPECT_EQ(selection.neighbourhoods[5].back(), 105);
}

TEST(Selection, AvoidsABlurredStretch) {
  std::vector<FrameMeasure> frames = uniform(1001);
  for (std::size_t i = 97; i <= 104; ++i) frames[i].sharpness = 5.0;
  const Selection selection = select(frames, options_for(50));
  EXPECT_TRUE(selection.keyframes[5] < 97 || selection.keyframes[5] > 104);
}

TEST(Selection, KeepsTheLeastBadOfALongBlurredStretch) {
  std::vector<FrameMeasure> frames = uniform(1001);
  for (std::size_t i = 70; i <= 130; ++i) frames[i].sharpness = 5.0;
  frames[101].sharpness = 6.0;
  const Selection selection = select(frames, options_for(50));
  EXPECT_EQ(selection.keyframes.size(), 50U);
  EXPECT_EQ(selection.keyframes[5], 101);
}

TEST(Selection, TwoKeyframesNeverShareAFrame) {
  // One frame stands out and lies in the neighbourhoods of several crossings.
  std::vector<FrameMeasure> frames = uniform(301);
  frames[101].sharpness = 1e6;
  const Selection selection = select(frames, options_for(75));
  ASSERT_EQ(selection.keyframes.size(), 75U);
  EXPECT_EQ(std::count(selection.keyframes.begin(), selection.keyframes.end(), 101), 1);
  EXPECT_LE(selection.widest_gap, 1.3);
}

TEST(Selection, TakesNothingWhileStanding) {
  std::vector<FrameMeasure> frames = uniform(900);
  for (std::size_t i = 300; i < 600; ++i) frames[i].motion = 0.0;
  const Selection selection = select(frames, options_for(75));
  const auto standing =
      std::count_if(selection.keyframes.begin(), selection.keyframes.end(), [](int i) { return i > 315 && i < 585; });
  EXPECT_EQ(standing, 0);
  EXPECT_EQ(selection.keyframes.size(), 75U);
}

TEST(Selection, AShortRecordingGivesFewerKeyframes) {
  EXPECT_EQ(select(uniform(120), options_for(75)).keyframes.size(), 40U);
  EXPECT_EQ(select(uniform(least_frames), options_for(75)).keyframes.size(), 2U);
}

TEST(Selection, ExplainsEveryFrame) {
  const std::vector<FrameMeasure> frames = random_recording(5, 400);
  const Selection selection = select(frames, options_for(75));
  ASSERT_EQ(selection.decisions.size(), frames.size());
  std::vector<int> chosen;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_TRUE(selection.decisions[i].reason.ends_with('.')) << selection.decisions[i].reason;
    if (selection.decisions[i].keyframe) chosen.push_back(static_cast<int>(i));
  }
  EXPECT_EQ(chosen, selection.keyframes);
}

TEST(Selection, KeepsAllPhotographs) {
  const Result<Selection> selection = keep_all(uniform(49));
  ASSERT_TRUE(selection);
  EXPECT_EQ(selection->keyframes.size(), 49U);
  EXPECT_FALSE(keep_all(uniform(least_frames - 1)));
}

TEST(Selection, RefusesWhatCannotBeSelectedFrom) {
  const Result<Selection> few = select_keyframes(uniform(least_frames - 1), {});
  ASSERT_FALSE(few);
  EXPECT_NE(few.error().message().find("too few frames"), std::string::npos);
  EXPECT_FALSE(select_keyframes({}, {}));
  const Result<Selection> still = select_keyframes(uniform(300, 0.0), {});
  ASSERT_FALSE(still);
  EXPECT_NE(still.error().message().find("did not move"), std::string::npos);
  EXPECT_FALSE(select_keyframes(uniform(300, std::nan("")), {}));

  for (const SelectionOptions& wrong : {SelectionOptions{.keyframes = 0}, SelectionOptions{.neighbourhood = -1},
                                        SelectionOptions{.sigma = 0.0}, SelectionOptions{.largest_gap = 0.9}}) {
    const Result<Selection> selection = select_keyframes(uniform(300), wrong);
    ASSERT_FALSE(selection);
    EXPECT_EQ(selection.error().kind, Error::Kind::usage);
  }
}

TEST(Selection, EachPassHasItsNumber) {
  EXPECT_EQ(SelectionOptions::for_pass("body").keyframes, 75);
  EXPECT_EQ(SelectionOptions::for_pass("head").keyframes, 50);
  EXPECT_EQ(SelectionOptions::for_pass("turn").keyframes, 120);
}

class SelectionProperties : public testing::TestWithParam<int> {};

TEST_P(SelectionProperties, HoldOnAnyRecording) {
  std::mt19937 random(static_cast<std::uint32_t>(GetParam()));
  const int frames = 230 + static_cast<int>(random() % 2200);
  const std::vector<FrameMeasure> recording = random_recording(static_cast<std::uint32_t>(GetParam()) + 100, frames);
  const SelectionOptions options = options_for(75);
  const Selection selection = select(recording, options);

  EXPECT_LE(selection.keyframes.size(), 75U);
  EXPECT_GE(selection.keyframes.size(), 74U);
  EXPECT_EQ(std::adjacent_find(selection.keyframes.begin(), selection.keyframes.end(), std::greater_equal<>()),
            selection.keyframes.end())
      << "ascending and distinct";
  EXPECT_GE(selection.keyframes.front(), 0);
  EXPECT_LT(selection.keyframes.back(), frames);
  EXPECT_LE(selection.widest_gap, 1.3 + 1e-9);
  for (std::size_t k = 0; k < selection.keyframes.size(); ++k) {
    const double sharpness = recording[static_cast<std::size_t>(selection.keyframes[k])].sharpness;
    for (const int other : selection.neighbourhoods[k]) {
      EXPECT_GE(sharpness, recording[static_cast<std::size_t>(other)].sharpness);
    }
  }
  EXPECT_EQ(select(recording, options).keyframes, selection.keyframes);
}

INSTANTIATE_TEST_SUITE_P(Seeds, SelectionProperties, testing::Range(0, 40));

}  // namespace
}  // namespace gyre
