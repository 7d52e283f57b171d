// SPDX-License-Identifier: Apache-2.0
// Cameras through the kernel's own interfaces, in a user-mode Linux kernel that has some (tests/system/uml): vivid, a
// USB camera that serves recorded pictures, and vimc. Skipped without a kernel.
#include "common/bundle/atomic_file.h"
#include "common/bundle/sha256.h"
#include "tests/system/guest.h"
#include "tests/system/programs.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>

namespace gyre {
namespace {

using nlohmann::json;

constexpr int width = 320;
constexpr int height = 240;
constexpr int recorded = 30;

class CameraGuest : public testing::Test {
 protected:
  void SetUp() override {
    if (const std::string lacking = Guest::lacking(); !lacking.empty()) GTEST_SKIP() << lacking;
  }

  // A recording whose pictures all differ.
  void record_pictures() {
    const auto folder = guest_.out() / "pictures";
    std::filesystem::create_directories(folder);
    for (int i = 0; i < recorded; ++i) {
      cv::Mat picture(height, width, CV_8UC3);
      cv::randu(picture, 0, 255);
      cv::GaussianBlur(picture, picture, {}, 3.0);
      cv::putText(picture, std::to_string(i), {80, 160}, cv::FONT_HERSHEY_SIMPLEX, 4.0, cv::Scalar::all(255), 8);
      const auto file = folder / (std::to_string(100 + i) + ".jpg");
      cv::imwrite(file.string(), picture);
      numbers_[sha256(read_file(file).value())] = i;
    }
  }

  // What camera_probe said into OUT/`file`.
  void read_probe(const std::string& file) {
    std::istringstream lines(read_file(guest_.out() / file).value_or(""));
    for (std::string line; std::getline(lines, line);) {
      const json said = json::parse(line, nullptr, false);
      if (said.is_discarded()) continue;
      if (said.contains("sha256")) {
        frames_.push_back(said);
      } else if (said.contains("queued")) {
        counters_ = said;
      } else if (said.value("timeout", false)) {
        ++recovering_;
      }
    }
    ASSERT_FALSE(counters_.is_null()) << guest_.log() << read_file(guest_.out() / file).value_or("");
    for (std::size_t i = 0; i < frames_.size(); ++i) EXPECT_EQ(frames_[i]["index"], i);
    EXPECT_EQ(counters_["queued"], counters_["completed"].get<int>() + counters_["cancelled"].get<int>());
    EXPECT_EQ(counters_["stray"], 0);
  }

  // Every frame is one of the recording, byte for byte, in the recording's order.
  void expect_recorded() const {
    int last = -1;
    for (const json& frame : frames_) {
      const auto number = numbers_.find(frame["sha256"]);
      ASSERT_NE(number, numbers_.end()) << "frame " << frame["index"] << " differs from the recording";
      // A busy machine may miss a whole round of them.
      EXPECT_TRUE(number->second != last || counters_["missed"].get<int>() >= recorded) << "twice: " << last;
      last = number->second;
    }
  }

  Guest guest_;
  std::map<std::string, int> numbers_;  // of the recording, by hash
  std::vector<json> frames_;
  json counters_;
  int recovering_ = 0;
};

class CameraGuestSlow : public CameraGuest {};

TEST_F(CameraGuest, FramesOfAUsbCameraAreTheRecordingByteForByte) {
  record_pictures();
  ASSERT_EQ(guest_.run(R"(
    plug_in $OUT/pictures 320 240 20
    $BIN/camera_probe v4l2:/dev/video0 40 lock >$OUT/probe
  )"),
            0)
      << guest_.log();
  read_probe("probe");
  ASSERT_EQ(frames_.size(), 40U);
  expect_recorded();
  EXPECT_EQ(counters_["restarts"], 0);
  EXPECT_NEAR(counters_["clock_offset"].get<double>(), 0.0, 1e-9);
  // Held at what the camera says: 156 units of 100 us, gain 16.
  EXPECT_EQ(counters_["held"], true);
  EXPECT_NEAR(frames_.back().value("exposure_s", 0.0), 0.0156, 1e-9);
  EXPECT_NEAR(frames_.back().value("gain", 0.0), 16.0, 1e-9);
  const std::string camera = read_file(guest_.out() / "usb-camera").value_or("");
  EXPECT_NE(camera.find("format MJPG"), std::string::npos);
  EXPECT_NE(camera.find("control 1.2 01"), std::string::npos) << "exposure not set to manual: " << camera;
}

TEST_F(CameraGuest, VividPassesTheLifecycle) {
  const int code = guest_.run(R"(
    modprobe vivid n_devs=1 node_types=0x1 num_inputs=1 input_types=0x0
    until_true 10 test -c /dev/video0
    export GYRE_TEST_V4L2='v4l2:/dev/video0?size=640x480'
    $BIN/camera_lifecycle_test --gtest_filter='*/v4l2'
    export GYRE_TEST_V4L2='v4l2:/dev/video0?size=320x180&format=NV12'
    $BIN/camera_lifecycle_test --gtest_filter='*/v4l2'
  )");
  EXPECT_EQ(code, 0) << guest_.log();
}

TEST_F(CameraGuestSlow, PulledOutAndPutBackInMidScan) {
  record_pictures();
  ASSERT_EQ(guest_.run(R"(
    plug_in $OUT/pictures 320 240 20
    $BIN/camera_probe v4l2:/dev/video0 80 >$OUT/probe & probe=$!
    until_true 20 grep -q '"index":20,' $OUT/probe
    pull_out
    until_true 20 grep -q '"timeout":true' $OUT/probe
    plug_in $OUT/pictures 320 240 20
    wait $probe
  )"),
            0)
      << guest_.log();
  read_probe("probe");
  ASSERT_EQ(frames_.size(), 80U);
  expect_recorded();
  EXPECT_GE(recovering_, 1);
  EXPECT_GE(counters_["reopenings"], 1);
}

TEST_F(CameraGuestSlow, ABrokenStreamAndARefusedStartAreOvercome) {
  ASSERT_EQ(guest_.run(R"(
    modprobe vivid n_devs=1 node_types=0x1 num_inputs=1 input_types=0x0
    until_true 10 test -c /dev/video0
    $BIN/camera_probe 'v4l2:/dev/video0?size=640x480' 60 >$OUT/probe & probe=$!
    until_true 20 grep -q '"index":10,' $OUT/probe
    v4l2-ctl -d /dev/video0 -c inject_fatal_streaming_error=1
    until_true 20 grep -q '"index":20,' $OUT/probe
    v4l2-ctl -d /dev/video0 -c inject_vidioc_streamon_error=1
    v4l2-ctl -d /dev/video0 -c inject_fatal_streaming_error=1
    wait $probe
  )"),
            0)
      << guest_.log();
  read_probe("probe");
  EXPECT_EQ(frames_.size(), 60U);
  EXPECT_GE(counters_["restarts"], 2);
}

TEST_F(CameraGuestSlow, DroppedBuffersAreCounted) {
  ASSERT_EQ(guest_.run(R"(
    modprobe vivid n_devs=1 node_types=0x1 num_inputs=1 input_types=0x0
    until_true 10 test -c /dev/video0
    v4l2-ctl -d /dev/video0 -c percentage_of_dropped_buffers=50
    $BIN/camera_probe 'v4l2:/dev/video0?size=640x480&format=NV12' 40 >$OUT/probe
  )"),
            0)
      << guest_.log();
  read_probe("probe");
  EXPECT_EQ(frames_.size(), 40U);
  EXPECT_GT(counters_["missed"], 10);
  EXPECT_EQ(counters_["reopenings"], 0);
}

TEST_F(CameraGuestSlow, ACameraWithoutAUsableFormatIsRefusedWithAReason) {
  EXPECT_EQ(guest_.run(R"(
    modprobe vivid n_devs=1 node_types=0x1 num_inputs=1 input_types=0x0
    until_true 10 test -c /dev/video0
    $BIN/camera_probe 'v4l2:/dev/video0?format=MJPG' 1
  )"),
            1)
      << guest_.log();
  EXPECT_NE(guest_.log().find("no picture format that can be used"), std::string::npos) << guest_.log();
}

TEST_F(CameraGuestSlow, TornPicturesOfAUsbCameraAreLeftOut) {
  record_pictures();
  ASSERT_EQ(guest_.run(R"(
    plug_in $OUT/pictures 320 240 20 --torn 4
    $BIN/camera_probe v4l2:/dev/video0 30 >$OUT/probe
  )"),
            0)
      << guest_.log();
  read_probe("probe");
  ASSERT_EQ(frames_.size(), 30U);
  expect_recorded();
  EXPECT_GE(counters_["torn"], 5);
}

TEST_F(CameraGuestSlow, AUsbCameraPassesTheLifecycleByV4l2AndByLibcamera) {
  record_pictures();
  const int code = guest_.run(R"(
    plug_in $OUT/pictures 320 240 30
    export GYRE_TEST_V4L2=v4l2:/dev/video0
    $BIN/camera_lifecycle_test --gtest_filter='*/v4l2'
    export GYRE_TEST_LIBCAMERA=libcamera:
    $BIN/camera_lifecycle_test --gtest_filter='*/libcamera'
  )");
  EXPECT_EQ(code, 0) << guest_.log();
}

TEST_F(CameraGuestSlow, FramesOfAUsbCameraByLibcameraAreTheRecordingByteForByte) {
  record_pictures();
  ASSERT_EQ(guest_.run(R"(
    plug_in $OUT/pictures 320 240 20
    $BIN/camera_probe libcamera: 40 lock >$OUT/probe
  )"),
            0)
      << guest_.log();
  read_probe("probe");
  ASSERT_EQ(frames_.size(), 40U);
  expect_recorded();
  EXPECT_EQ(counters_["held"], true);
}

TEST_F(CameraGuestSlow, ByLibcameraTooACameraMayBePulledOutAndPutBack) {
  if (!std::filesystem::exists("/lib/systemd/systemd-udevd")) GTEST_SKIP() << "not installed here: udev";
  record_pictures();
  ASSERT_EQ(guest_.run(R"(
    start_udev
    plug_in $OUT/pictures 320 240 20
    $BIN/camera_probe libcamera: 60 >$OUT/probe & probe=$!
    until_true 20 grep -q '"index":20,' $OUT/probe
    pull_out
    until_true 20 grep -q '"timeout":true' $OUT/probe
    plug_in $OUT/pictures 320 240 20
    wait $probe
  )"),
            0)
      << guest_.log();
  read_probe("probe");
  ASSERT_EQ(frames_.size(), 60U);
  expect_recorded();
  EXPECT_GE(counters_["reopenings"], 1);
}

TEST_F(CameraGuestSlow, PicturesThatAProgramPutsIntoALoopComeOutByteForByte) {
  record_pictures();
  ASSERT_EQ(guest_.run(R"(
    modprobe v4l2loopback devices=1 video_nr=10 exclusive_caps=1
    until_true 10 test -c /dev/video10
    python3 $HERE/loop_feeder.py $OUT/pictures /dev/video10 320 240 20 & feeder=$!
    until_true 20 eval 'v4l2-ctl -d /dev/video10 --list-formats | grep -q MJPG'
    $BIN/camera_probe v4l2:/dev/video10 30 >$OUT/probe
    kill $feeder
  )"),
            0)
      << guest_.log();
  read_probe("probe");
  ASSERT_EQ(frames_.size(), 30U);
  expect_recorded();
}

TEST_F(CameraGuestSlow, VimcPassesTheLifecycle) {
  const int code = guest_.run(R"(
    modprobe vimc
    until_true 10 test -c /dev/video0
    mark_devices
    export GYRE_TEST_LIBCAMERA='libcamera:?size=640x480'
    $BIN/camera_lifecycle_test --gtest_filter='*/libcamera'
  )");
  EXPECT_EQ(code, 0) << guest_.log();
}

}  // namespace
}  // namespace gyre
