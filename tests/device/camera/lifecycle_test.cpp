// SPDX-License-Identifier: Apache-2.0
// What must hold for every camera however it is started and stopped. The replay is there everywhere; devices are named
// by the environment (GYRE_TEST_V4L2, GYRE_TEST_LIBCAMERA: names of cameras), which tests/system/camera_guest_test.cpp
// sets in a machine that has some.
#include "device/camera/camera_name.h"
#include "device/camera/faulty_replay.h"
#include "device/camera/libcamera_camera.h"
#include "device/camera/replay_camera.h"
#include "device/camera/v4l2_camera.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>

namespace gyre {
namespace {

using namespace std::chrono_literals;

constexpr auto patience = 20s;  // for a frame, on a machine that does other things

constexpr const char* v4l2 = "GYRE_TEST_V4L2";
constexpr const char* libcamera = "GYRE_TEST_LIBCAMERA";

std::vector<std::string> cameras() {
  std::vector<std::string> there = {"replay"};
  if (std::getenv(v4l2) != nullptr) there.emplace_back("v4l2");
  if (std::getenv(libcamera) != nullptr) there.emplace_back("libcamera");
  return there;
}

class CameraLifecycle : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    if (GetParam() == "replay") {
      for (int i = 0; i < 200; ++i)
        cv::imwrite((folder_.path() / (std::to_string(i) + ".jpg")).string(), cv::Mat(16, 16, CV_8UC3));
      return;
    }
    const char* const name = std::getenv(GetParam() == "v4l2" ? v4l2 : libcamera);
    const Result<CameraName> parsed = parse_camera_name(name);
    ASSERT_TRUE(parsed) << parsed.error().message();
    name_ = *parsed;
  }

  // A device as it is, without the ladder that would hide its failures.
  std::unique_ptr<CameraDevice> open(int buffers) {
    Result<std::unique_ptr<CameraDevice>> camera = open_by_kind(buffers);
    EXPECT_TRUE(camera) << camera.error().message();
    return camera ? std::move(*camera) : nullptr;
  }

  Result<std::unique_ptr<CameraDevice>> open_by_kind(int buffers) {
    if (GetParam() == "replay") {
      Result<std::unique_ptr<CameraDevice>> recording = open_replay_camera(folder_.path(), Pace::fast);
      if (!recording) return recording;
      return FaultyReplay(std::move(*recording), {}, std::make_shared<ReplayClock>()).open();
    }
    name_.buffers = buffers;
    std::string identity;
    return GetParam() == "v4l2" ? open_v4l2_camera(name_, identity) : open_libcamera(name_);
  }

  // Takes that many frames, numbered from `first`.
  static void take(CameraDevice& camera, int count, int first = 0) {
    double last = -1.0;
    for (int i = first; i < first + count; ++i) {
      const Result<CameraEvent> event = camera.next(patience);
      ASSERT_TRUE(event) << event.error().message();
      ASSERT_EQ(event->kind, CameraEvent::Kind::frame);
      EXPECT_EQ(event->frame->index, i);
      EXPECT_GT(event->frame->time, last);
      EXPECT_FALSE(event->frame->image.empty());
      EXPECT_TRUE(!event->frame->jpeg.empty() || event->frame->full);
      last = event->frame->time;
    }
  }

  // Every request came back once.
  static void expect_settled(const CameraDevice& camera) {
    const CameraCounters counters = camera.counters();
    EXPECT_EQ(counters.queued, counters.completed + counters.cancelled);
    EXPECT_EQ(counters.stray, 0);
  }

  TemporaryFolder folder_;
  CameraName name_;
};

TEST_P(CameraLifecycle, StartsAndStopsInEveryOrder) {
  const std::unique_ptr<CameraDevice> camera = open(4);
  ASSERT_TRUE(camera);
  EXPECT_GT(camera->info().width, 0);
  EXPECT_GT(camera->info().height, 0);
  EXPECT_TRUE(camera->info().live);
  camera->stop();
  EXPECT_FALSE(camera->next(0ms));
  ASSERT_TRUE(camera->start());
  ASSERT_TRUE(camera->start());
  take(*camera, 2);
  ASSERT_TRUE(camera->start());
  take(*camera, 1, 2);
  camera->stop();
  camera->stop();
  expect_settled(*camera);
  EXPECT_FALSE(camera->next(0ms));
  // Without taking a frame, and with frames that wait to be taken.
  for (const int frames : {0, 0, 1, 3}) {
    ASSERT_TRUE(camera->start());
    take(*camera, frames);
    camera->stop();
    expect_settled(*camera);
  }
}

// Every sequence of three steps, with every number of buffers.
TEST_P(CameraLifecycle, EveryPatternOfStartsAndStops) {
  enum Step { start, stop, take_one };
  constexpr int steps = 3, patterns = steps * steps * steps;
  for (int buffers = 1; buffers <= 8; ++buffers) {
    const std::unique_ptr<CameraDevice> camera = open(buffers);
    ASSERT_TRUE(camera);
    bool is_started = false;
    int taken = 0;
    for (int pattern = 0; pattern < patterns; ++pattern) {
      for (int rest = pattern, i = 0; i < steps; ++i, rest /= steps) {
        SCOPED_TRACE(std::to_string(buffers) + " buffers, pattern " + std::to_string(pattern));
        switch (rest % steps) {
          case start:
            ASSERT_TRUE(camera->start());
            if (!std::exchange(is_started, true)) taken = 0;
            break;
          case stop:
            camera->stop();
            is_started = false;
            expect_settled(*camera);
            break;
          case take_one:
            if (is_started) {
              take(*camera, 1, taken++);
            } else {
              EXPECT_FALSE(camera->next(0ms));
            }
            break;
        }
      }
    }
    camera->stop();
    expect_settled(*camera);
  }
}

TEST_P(CameraLifecycle, WorksWithOneToEightBuffers) {
  for (int buffers = 1; buffers <= 8; ++buffers) {
    const std::unique_ptr<CameraDevice> camera = open(buffers);
    ASSERT_TRUE(camera);
    ASSERT_TRUE(camera->start());
    take(*camera, buffers + 1);
    camera->stop();
    expect_settled(*camera);
    EXPECT_GE(camera->counters().completed, buffers + 1);
  }
}

TEST_P(CameraLifecycle, MayGoWhileItStreamsAndComeBack) {
  for (int i = 0; i < 3; ++i) {
    const std::unique_ptr<CameraDevice> camera = open(4);
    ASSERT_TRUE(camera);
    ASSERT_TRUE(camera->start());
    take(*camera, i);
  }
}

TEST_P(CameraLifecycle, PicturesOutliveTheStream) {
  const std::unique_ptr<CameraDevice> camera = open(2);
  ASSERT_TRUE(camera);
  ASSERT_TRUE(camera->start());
  std::vector<Frame> frames;
  for (int i = 0; i < 5; ++i) {
    Result<CameraEvent> event = camera->next(patience);
    ASSERT_TRUE(event && event->frame);
    frames.push_back(std::move(*event->frame));
  }
  camera->stop();
  for (const Frame& frame : frames) {
    const Result<std::string> jpeg = frame.full ? frame.full->jpeg() : Result<std::string>(frame.jpeg);
    ASSERT_TRUE(jpeg) << jpeg.error().message();
    const cv::Mat picture = cv::imdecode(std::vector<char>(jpeg->begin(), jpeg->end()), cv::IMREAD_COLOR);
    EXPECT_EQ(picture.size(), cv::Size(camera->info().width, camera->info().height));
  }
}

TEST_P(CameraLifecycle, IsHeldOnceAndOverStops) {
  const std::unique_ptr<CameraDevice> camera = open(4);
  ASSERT_TRUE(camera);
  ASSERT_TRUE(camera->start());
  camera->lock(200ms);
  for (int i = 0; i < 50 && camera->locked() != CameraLock::held; ++i) ASSERT_TRUE(camera->next(patience));
  EXPECT_EQ(camera->locked(), CameraLock::held);
  camera->stop();
  ASSERT_TRUE(camera->start());
  EXPECT_EQ(camera->locked(), CameraLock::held);
  take(*camera, 2);
  camera->unlock();
  take(*camera, 1, 2);
  camera->stop();
  expect_settled(*camera);
}

INSTANTIATE_TEST_SUITE_P(Cameras, CameraLifecycle, testing::ValuesIn(cameras()),
                         [](const auto& about) { return about.param; });

}  // namespace
}  // namespace gyre
