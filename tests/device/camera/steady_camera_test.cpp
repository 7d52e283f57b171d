// SPDX-License-Identifier: Apache-2.0
// The ladder on a recording that plays a failing camera. Time passes only where somebody waits.
#include "device/camera/steady_camera.h"

#include "common/bundle/atomic_file.h"
#include "device/camera/faulty_replay.h"
#include "device/camera/replay_camera.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

namespace gyre {
namespace {

using namespace std::chrono_literals;
using Kind = Fault::Kind;
using Until = Fault::Until;

constexpr int frames = 40;  // one a second

class SteadyCamera : public testing::Test {
 protected:
  void SetUp() override {
    for (int i = 0; i < frames; ++i) {
      const std::string file = (folder_.path() / (std::to_string(i) + ".jpg")).string();
      cv::imwrite(file, cv::Mat(32, 32, CV_8UC3, cv::Scalar::all(5 * i)));
    }
  }

  void open(std::vector<Fault> faults, const SteadyOptions& options = {}) {
    Result<std::unique_ptr<CameraDevice>> recording = open_replay_camera(folder_.path(), Pace::fast);
    ASSERT_TRUE(recording);
    clock_ = std::make_shared<ReplayClock>();
    const auto replay = std::make_shared<FaultyReplay>(std::move(*recording), std::move(faults), clock_);
    auto camera = open_steady_camera([replay] { return replay->open(); }, clock_, options);
    ASSERT_TRUE(camera);
    camera_ = std::move(*camera);
    ASSERT_TRUE(camera_->start());
  }

  // The numbers in the recording of the frames that came, up to the end.
  std::vector<int> play() {
    std::vector<int> shown;
    double last = -1.0;
    for (;;) {
      Result<CameraEvent> event = camera_->next(1000ms);
      if (!event) {
        error_ = event.error().message();
        return shown;
      }
      if (event->kind == CameraEvent::Kind::ended) return shown;
      if (event->kind == CameraEvent::Kind::timeout) {
        if (event->recovering) ++recovering_;
        continue;
      }
      EXPECT_EQ(event->frame->index, static_cast<int>(shown.size()));
      EXPECT_GT(event->frame->time, last);
      last = event->frame->time;
      shown.push_back(number(*event->frame));
    }
  }

  static int number(const Frame& frame) { return (frame.image.at<cv::Vec3b>(16, 16)[0] + 2) / 5; }

  static std::vector<int> all_but(std::initializer_list<int> left_out) {
    std::vector<int> rest;
    for (int i = 0; i < frames; ++i) {
      if (std::find(left_out.begin(), left_out.end(), i) == left_out.end()) rest.push_back(i);
    }
    return rest;
  }

  TemporaryFolder folder_;
  std::shared_ptr<ReplayClock> clock_;
  std::unique_ptr<CameraDevice> camera_;
  std::string error_;
  int recovering_ = 0;
};

TEST_F(SteadyCamera, WithoutFaultsEveryFrameComesAtItsTime) {
  open({});
  EXPECT_TRUE(camera_->info().live);
  EXPECT_EQ(play(), all_but({}));
  EXPECT_NEAR(clock_->now(), frames - 1, 1e-6);
  const CameraCounters counters = camera_->counters();
  EXPECT_EQ(counters.restarts + counters.reopenings, 0);
}

TEST_F(SteadyCamera, MissingAndTornFramesAreCountedAndTheRestIsNumberedWithoutHoles) {
  open({{Kind::missing, 5, 2}, {Kind::torn, 10}, {Kind::late, 20, 1, 1.5}});
  EXPECT_EQ(play(), all_but({5, 6, 10}));
  EXPECT_EQ(camera_->counters().missed, 2);
  EXPECT_EQ(camera_->counters().torn, 1);
  EXPECT_EQ(camera_->counters().restarts, 0);
}

TEST_F(SteadyCamera, SoManyMissingFramesThatTheStreamIsStartedAgainCostNoMoreThanThemselves) {
  open({{Kind::missing, 5, 6}, {Kind::torn, 20, 5}});
  EXPECT_EQ(play(), all_but({5, 6, 7, 8, 9, 10, 20, 21, 22, 23, 24}));
  EXPECT_GE(camera_->counters().restarts, 2);
}

TEST_F(SteadyCamera, SilenceIsEndedByARestart) {
  open({{Kind::silence, 15, 1, 0.0, Until::restart}});
  EXPECT_EQ(play(), all_but({}));
  EXPECT_EQ(camera_->counters().restarts, 1);
  EXPECT_EQ(camera_->counters().reopenings, 0);
}

TEST_F(SteadyCamera, AShortSilenceIsWaitedFor) {
  open({{Kind::silence, 15, 1, 1.5}});
  EXPECT_EQ(play(), all_but({}));
  EXPECT_EQ(camera_->counters().restarts, 0);
}

TEST_F(SteadyCamera, WhatNoRestartEndsIsEndedByOpeningTheDeviceAgain) {
  for (const Kind kind : {Kind::silence, Kind::broken}) {
    open({{kind, 15, 1, 0.0, Until::reopen}});
    EXPECT_EQ(play(), all_but({}));
    EXPECT_EQ(camera_->counters().restarts, 2);
    EXPECT_EQ(camera_->counters().reopenings, 1);
  }
}

TEST_F(SteadyCamera, AnUnpluggedCameraIsWaitedFor) {
  open({{Kind::gone, 15, 1, 12.5}});
  EXPECT_EQ(play(), all_but({}));
  EXPECT_GE(recovering_, 10);
  EXPECT_GE(camera_->counters().reopenings, 10);
  // The scan's time goes on with the time that passed.
  EXPECT_GT(clock_->now(), frames - 1 + 12.0);
}

TEST_F(SteadyCamera, FaultsOneAfterTheOtherAreClimbedOneByOne) {
  open({{Kind::broken, 3, 1, 0.0, Until::restart},
        {Kind::silence, 5, 1, 0.0, Until::reopen},
        {Kind::torn, 12, 2},
        {Kind::gone, 20, 1, 0.0, Until::reopen},
        {Kind::broken, 30, 1, 2.0}});
  EXPECT_EQ(play(), all_but({12, 13}));
  EXPECT_TRUE(error_.empty()) << error_;
}

TEST_F(SteadyCamera, ACameraThatStaysAwayIsGivenUp) {
  open({{Kind::gone, 15, 1, 0.0, Until::never}});
  EXPECT_EQ(play().size(), 15U);
  EXPECT_NE(error_.find("does not come back"), std::string::npos);
  EXPECT_NEAR(clock_->now(), 14.0 + LadderOptions{}.patience, 3.0);
}

TEST_F(SteadyCamera, StartedAgainTheRecordingBeginsAnewWithItsFaults) {
  open({{Kind::silence, 15, 1, 0.0, Until::restart}});
  EXPECT_EQ(play(), all_but({}));
  camera_->stop();
  EXPECT_FALSE(camera_->next(1ms));
  ASSERT_TRUE(camera_->start());
  ASSERT_TRUE(camera_->start());
  EXPECT_EQ(play(), all_but({}));
  EXPECT_EQ(camera_->counters().restarts, 2);
}

TEST_F(SteadyCamera, IsWiredByName) {
  const std::string script = (folder_.path() / "faults.json").string();
  ASSERT_TRUE(
      write_file(script, std::string_view(R"({"faults": [{"before_frame": 4, "kind": "gone", "seconds": 3}]})")));
  auto camera = open_camera("replay:" + folder_.path().string() + "?faults=" + script, Pace::fast);
  ASSERT_TRUE(camera) << camera.error().message();
  camera_ = std::move(*camera);
  ASSERT_TRUE(camera_->start());
  EXPECT_EQ(play(), all_but({}));
  EXPECT_GE(camera_->counters().reopenings, 1);
  ASSERT_TRUE(write_file(script, std::string_view("{}")));
  const auto wrong = open_camera("replay:" + folder_.path().string() + "?faults=" + script, Pace::fast);
  ASSERT_FALSE(wrong);
  EXPECT_EQ(wrong.error().exit_code(), 2);
}

// A camera that comes back as another one, and remembers whether it was locked.
class OtherCamera : public CameraDevice {
 public:
  OtherCamera(int width, bool& locked) : locked_(locked) { info_ = {.name = "other", .width = width, .height = 8}; }
  const CameraInfo& info() const override { return info_; }
  Result<void> start() override { return {}; }
  void stop() override {}
  Result<CameraEvent> next(std::chrono::milliseconds) override { return fail("broken"); }
  void lock(std::chrono::milliseconds) override { locked_ = true; }
  void unlock() override { locked_ = false; }
  Result<void> recall(const std::vector<int>&, const std::function<Result<void>(const Frame&)>&) override { return {}; }

 private:
  CameraInfo info_;
  bool& locked_;
};

TEST(SteadyCameraReopening, RefusesAnotherCameraAndLocksTheSameAgain) {
  bool locked = false;
  int width = 8;
  const auto clock = std::make_shared<ReplayClock>();
  const auto factory = [&]() -> Result<std::unique_ptr<CameraDevice>> {
    locked = false;
    return std::make_unique<OtherCamera>(width, locked);
  };
  auto camera = open_steady_camera(factory, clock);
  ASSERT_TRUE(camera);
  ASSERT_TRUE((*camera)->start());
  (*camera)->lock(1s);
  locked = false;
  ASSERT_TRUE((*camera)->next(100ms));
  EXPECT_TRUE(locked);
  width = 16;
  Result<CameraEvent> event = (*camera)->next(5s);
  for (int i = 0; i < 100 && event; ++i) event = (*camera)->next(5s);
  ASSERT_FALSE(event);
  EXPECT_NE(event.error().message().find("another camera"), std::string::npos);
}

}  // namespace
}  // namespace gyre
