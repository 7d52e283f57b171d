// SPDX-License-Identifier: Apache-2.0
#include "device/analysis/pass_analysis.h"
#include "tests/device/moving_scene.h"

#include <gtest/gtest.h>
#include <set>

namespace gyre {
namespace {

using namespace std::chrono_literals;

TEST(PassAnalysis, ProposesFramesWithTheirOwnPicture) {
  test::MovingScene scene(120);
  PassAnalysis analysis("body", scene.info());
  std::set<int> proposed;
  for (;;) {
    Result<CameraEvent> event = scene.next(1s);
    if (event->kind == CameraEvent::Kind::ended) break;
    const std::optional<Frame> frame = analysis.add(std::move(*event->frame));
    if (!frame) continue;
    EXPECT_TRUE(proposed.insert(frame->index).second);
    const Result<void> same = scene.recall({frame->index}, [&](const Frame& original) -> Result<void> {
      EXPECT_EQ(cv::norm(original.image, frame->image, cv::NORM_INF), 0.0);
      return {};
    });
    EXPECT_TRUE(same);
  }
  EXPECT_FALSE(proposed.empty());
  EXPECT_EQ(analysis.count(), 120);
  EXPECT_EQ(analysis.finish()->keyframes,
            select_keyframes(analysis.measures(), SelectionOptions::for_pass("body"))->keyframes);
}

TEST(PassAnalysis, EveryFrameHasItsTimeAndTheSettingsItWasTakenWith) {
  test::MovingScene scene(40);
  PassAnalysis analysis("body", scene.info());
  const auto exposure_at = [](int i) { return i < 10 ? std::nullopt : std::optional(i < 25 ? 0.01 : 0.02); };
  for (int i = 0; i < 40; ++i) {
    Frame frame = std::move(*scene.next(1s)->frame);
    frame.time = 0.1 * i;
    frame.settings.exposure_s = exposure_at(i);
    analysis.add(std::move(frame));
  }
  const std::vector<MeasuredFrame> frames = analysis.frames();
  ASSERT_EQ(frames.size(), 40U);
  for (int i = 0; i < 40; ++i) {
    const auto at = static_cast<std::size_t>(i);
    EXPECT_EQ(frames[at].time, 0.1 * i);
    EXPECT_EQ(frames[at].measure.sharpness, analysis.measures()[at].sharpness);
    EXPECT_EQ(frames[at].settings.exposure_s, exposure_at(i)) << i;
  }
}

TEST(PassAnalysis, EveryPhotographIsSentAtOnce) {
  test::MovingScene scene(10);
  CameraInfo info = scene.info();
  info.photographs = true;
  info.fps = 0.0;
  PassAnalysis analysis("head", info);
  for (int i = 0; i < 10; ++i) {
    const std::optional<Frame> frame = analysis.add(std::move(*scene.next(1s)->frame));
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->index, i);
  }
  EXPECT_EQ(analysis.finish()->keyframes.size(), 10U);
}

TEST(PassAnalysis, WorksForACameraWithoutAnEnd) {
  test::MovingScene scene(60);
  CameraInfo info = scene.info();
  info.expected_frames = 0;
  PassAnalysis analysis("body", info);
  for (int i = 0; i < 60; ++i) analysis.add(std::move(*scene.next(1s)->frame));
  EXPECT_EQ(analysis.finish()->keyframes.size(), 20U);
}

}  // namespace
}  // namespace gyre
