// SPDX-License-Identifier: Apache-2.0
#include "device/camera/replay_camera.h"

#include <gtest/gtest.h>
#include <unistd.h>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

namespace gyre {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

class ReplayCamera : public testing::Test {
 protected:
  void SetUp() override {
    const std::string name = testing::UnitTest::GetInstance()->current_test_info()->name();
    folder_ = fs::temp_directory_path() / ("gyre-camera-" + name + "-" + std::to_string(::getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    for (int i = 0; i < frames; ++i) {
      cv::imwrite((folder_ / (std::to_string(i) + ".png")).string(), cv::Mat(12, 16, CV_8UC3, cv::Scalar(i, 0, 0)));
    }
    Result<std::unique_ptr<CameraDevice>> camera = open_replay_camera(folder_, Pace::fast);
    ASSERT_TRUE(camera) << camera.error().message();
    camera_ = std::move(*camera);
  }
  void TearDown() override { fs::remove_all(folder_); }

  // Values of the frames up to the end.
  std::vector<int> play() {
    std::vector<int> values;
    for (;;) {
      const Result<CameraEvent> event = camera_->next(100ms);
      if (!event || event->kind != CameraEvent::Kind::frame) break;
      EXPECT_EQ(event->frame->index, static_cast<int>(values.size()));
      values.push_back(event->frame->image.at<cv::Vec3b>(0, 0)[0]);
    }
    return values;
  }

  static constexpr int frames = 9;
  fs::path folder_;
  std::unique_ptr<CameraDevice> camera_;
};

const std::vector<int> all = {0, 1, 2, 3, 4, 5, 6, 7, 8};

TEST_F(ReplayCamera, KnowsItsRecording) {
  EXPECT_EQ(camera_->info().width, 16);
  EXPECT_EQ(camera_->info().height, 12);
  EXPECT_EQ(camera_->info().expected_frames, frames);
  EXPECT_TRUE(camera_->info().photographs);
}

TEST_F(ReplayCamera, PlaysEveryFrameOnceThenEnds) {
  ASSERT_TRUE(camera_->start());
  EXPECT_EQ(play(), all);
  EXPECT_EQ(camera_->next(100ms)->kind, CameraEvent::Kind::ended);
  EXPECT_EQ(camera_->next(100ms)->kind, CameraEvent::Kind::ended);
}

TEST_F(ReplayCamera, StartsAgainFromTheFirstFrame) {
  ASSERT_TRUE(camera_->start());
  ASSERT_TRUE(camera_->start());
  EXPECT_EQ(camera_->next(100ms)->frame->index, 0);
  EXPECT_EQ(camera_->next(100ms)->frame->index, 1);
  camera_->stop();
  camera_->stop();
  EXPECT_FALSE(camera_->next(100ms));
  ASSERT_TRUE(camera_->start());
  EXPECT_EQ(play(), all);
}

TEST_F(ReplayCamera, RecallsFrames) {
  std::vector<int> values;
  const Result<void> recalled = camera_->recall({1, 2, 7}, [&](const Frame& frame) -> Result<void> {
    values.push_back(frame.image.at<cv::Vec3b>(0, 0)[0]);
    return {};
  });
  ASSERT_TRUE(recalled);
  EXPECT_EQ(values, (std::vector<int>{1, 2, 7}));
  EXPECT_FALSE(camera_->recall({frames}, [](const Frame&) -> Result<void> { return {}; }));
  const Result<void> refused = camera_->recall({1}, [](const Frame&) -> Result<void> { return fail("disk full"); });
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().what, "disk full");
}

TEST_F(ReplayCamera, IsOpenedByName) {
  EXPECT_TRUE(open_camera("replay:" + folder_.string(), Pace::fast));
  const auto unknown = open_camera("webcam", Pace::fast);
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().exit_code(), 2);
  const auto missing = open_camera("replay:" + (folder_ / "none").string(), Pace::fast);
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().exit_code(), 1);
}

}  // namespace
}  // namespace gyre
