// SPDX-License-Identifier: Apache-2.0
// Button and lights through the kernel's own interfaces, in a user-mode Linux kernel with gpio-sim (tests/system/uml).
// Skipped without a kernel.
#include "common/bundle/atomic_file.h"
#include "common/bundle/bundle.h"
#include "common/bundle/sha256.h"
#include "tests/system/guest.h"

#include <gtest/gtest.h>
#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <set>

namespace gyre {
namespace {

namespace fs = std::filesystem;

class PanelGuest : public testing::Test {
 protected:
  void SetUp() override {
    if (const std::string lacking = Guest::lacking(); !lacking.empty()) GTEST_SKIP() << lacking;
  }
  std::string said(const std::string& file) const { return read_file(guest_.out() / file).value_or(""); }

  Guest guest_;
};

TEST_F(PanelGuest, AThousandBouncingPressesAreAThousandEvents) {
  const int code = guest_.run(R"(
    plug_panel
    $BIN/gyre-device panel --button '!GYRE_BUTTON' --debounce-ms 10 >$OUT/presses 2>$OUT/panel & daemon=$!
    until_true 20 grep -q 'press the button' $OUT/panel
    for ((press = 0; press < 1000; ++press)); do
      for ways in 'down up' 'up down'; do
        set -- $ways
        for ((bounce = press % 7; bounce > 0; --bounce)); do
          echo pull-$1 >$panel/sim_gpio2/pull
          rest 0.000$((1 + (press + bounce) % 9))
          echo pull-$2 >$panel/sim_gpio2/pull
          rest 0.00$((1 + (press + bounce) % 3))
        done
        echo pull-$1 >$panel/sim_gpio2/pull
        rest 0.0$((3 + press % 5))
      done
    done
    sleep 1
    kill -TERM $daemon
    wait $daemon
  )",
                              Guest::Time::virtual_time);
  EXPECT_EQ(code, 0) << guest_.log() << said("panel");
  const std::string presses = said("presses");
  EXPECT_EQ(std::count(presses.begin(), presses.end(), '\n'), 1000);
  EXPECT_EQ(presses.find("long"), std::string::npos);
}

TEST_F(PanelGuest, ShortLongAndVeryLongAreToldApartAndLightsShowTheirColours) {
  const int code = guest_.run(R"(
    plug_panel
    $BIN/gyre-device panel --button '!gyre-panel:2' --red GYRE_RED --green GYRE_GREEN --blue gyre-panel:5 \
      >$OUT/presses 2>$OUT/panel & daemon=$!
    until_true 20 grep -q 'press the button' $OUT/panel
    until_true 2 eval '[ $(lights) = 111 ]'
    sleep 3
    until_true 2 eval '[ $(lights) = 010 ]'
    until_true 2 eval '[ $(lights) = 000 ]'
    sleep 3
    until_true 2 eval '[ $(lights) = 001 ]'
    sleep 3
    until_true 2 eval '[ $(lights) = 110 ]'
    sleep 3
    until_true 2 eval '[ $(lights) = 100 ]'
    press 0.3; press 1.5; press 5
    kill -TERM $daemon
    wait $daemon
    [ $(lights) = 000 ]
  )",
                              Guest::Time::virtual_time);
  EXPECT_EQ(code, 0) << guest_.log() << said("panel");
  EXPECT_EQ(said("presses"), "{\"press\":\"short\"}\n{\"press\":\"long\"}\n{\"press\":\"very_long\"}\n");
}

TEST_F(PanelGuest, WhatIsMissingOrBusyIsSaidAndTheRestWorks) {
  const int code = guest_.run(R"(
    plug_panel
    $BIN/gyre-device panel --green GYRE_GREEN 2>$OUT/first & first=$!
    until_true 20 grep -q 'press the button' $OUT/first
    $BIN/gyre-device panel --button '!GYRE_BUTTON' --red GYRE_VIOLET --green GYRE_GREEN --blue other-panel:5 \
      >$OUT/presses 2>$OUT/panel & daemon=$!
    until_true 20 grep -q 'press the button' $OUT/panel
    press 0.2
    kill -TERM $daemon
    wait $daemon && exit 9
    kill -TERM $first
    wait $first
    # Another chip takes the number; the label stays.
    pull_panel
    mkdir -p /sys/kernel/config/gpio-sim/other/bank0
    echo 1 >/sys/kernel/config/gpio-sim/other/live
    plug_panel
    $BIN/gyre-device panel --button '!gyre-panel:2' >>$OUT/presses 2>$OUT/again & daemon=$!
    until_true 20 grep -q 'press the button' $OUT/again
    press 0.2
    kill -TERM $daemon
    wait $daemon
  )",
                              Guest::Time::virtual_time);
  EXPECT_EQ(code, 0) << guest_.log() << said("panel");
  const std::string log = said("panel");
  EXPECT_NE(log.find("no such GPIO line: GYRE_VIOLET"), std::string::npos) << log;
  EXPECT_NE(log.find("the GPIO line is busy: GYRE_GREEN"), std::string::npos) << log;
  EXPECT_NE(log.find("no GPIO chip has that label: other-panel"), std::string::npos) << log;
  EXPECT_EQ(said("presses"), "{\"press\":\"short\"}\n{\"press\":\"short\"}\n");
}

// From the button to keyframes that the host has. camera: commands that plug one in as /dev/video0.
class WholeScanSlow : public PanelGuest {
 protected:
  // during: commands while the first pass is on and has three keyframes.
  void scan(const std::string& camera, const std::string& settings, const std::string& during = "") {
    const int code = guest_.run("camera='v4l2:/dev/video0" + settings + "'\n" + camera + R"sh(
      plug_panel
      $BIN/gyre-offload serve --store /tmp/host --endpoint 'tcp://127.0.0.1:7410' --page off --reserve-gib 0.1 >$OUT/ready 2>$OUT/host &
      until_true 60 grep -q public_key $OUT/ready
      field() { sed -E "s/.*\"$1\":\"([^\"]*)\".*/\1/" "$2"; }
      $BIN/gyre-device pair --keys /tmp/keys --host-public-key "$(field public_key $OUT/ready)" >$OUT/pair
      $BIN/gyre-offload pair --store /tmp/host --authorise "$(field device_public_key $OUT/pair)" --name rig
      printf '[run]\ncamera = "%s"\nhost = "tcp://127.0.0.1:7410"\nkeys = "/tmp/keys"\n' "$camera" >/tmp/rig.toml
      printf 'spool = "%s/spool"\nheight-mm = 1700\n[panel]\nbutton = "!GYRE_BUTTON"\n' "$OUT" >>/tmp/rig.toml
      printf 'red = "GYRE_RED"\ngreen = "GYRE_GREEN"\nblue = "GYRE_BLUE"\n' >>/tmp/rig.toml
      $BIN/gyre-device --config /tmp/rig.toml run 2>$OUT/device & daemon=$!
      until_true 60 grep -q 'waiting for the button' $OUT/device
      press 0.1
      until_true 30 grep -q 'arming on .*: pass' $OUT/device
      until_true 90 eval '[ $(ls $OUT/spool/*/frames/body-* | wc -l) -ge 3 ]'
      )sh" + during + R"sh(
      press 0.1
      until_true 30 grep -q ': between_passes' $OUT/device
      press 1.5
      until_true 30 grep -q ': waiting_for_host' $OUT/device
      until_true 60 eval 'grep -q acknowledged $OUT/spool/*/spool.jsonl'
      kill -TERM $daemon
      wait $daemon
      [ $(lights) = 000 ]
    )sh");
    EXPECT_EQ(code, 0) << guest_.log() << said("device") << said("host");
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(guest_.out() / "spool", error)) {
      if (fs::exists(entry.path() / "scan.json")) bundles_.emplace_back(entry.path());
    }
    ASSERT_EQ(bundles_.size(), 1U) << guest_.log() << said("device") << said("host");
    const Result<void> verified = verify_bundle(bundles_[0]);
    EXPECT_TRUE(verified) << verified.error().message();
    frames_ = list_frames(bundles_[0]).value();
    EXPECT_GE(frames_.size(), 8U);
  }

  std::vector<Bundle> bundles_;
  std::vector<FrameId> frames_;
};

TEST_F(WholeScanSlow, OfASensorWhosePicturesAreCompressedHere) {
  scan(R"(
    modprobe vivid n_devs=1 node_types=0x1 num_inputs=1 input_types=0x0
    until_true 10 test -c /dev/video0
    v4l2-ctl -d /dev/video0 -c horizontal_movement=5
  )",
       "?size=320x180");
}

class WholeUsbScanSlow : public WholeScanSlow {
 protected:
  static constexpr int width = 320, height = 240;

  // A walk along a texture, as files that a USB camera serves.
  void record_pictures() {
    fs::create_directories(guest_.out() / "pictures");
    constexpr int pictures = 300, step = 4;
    cv::Mat texture(height, width + step * pictures, CV_8UC3);
    cv::RNG(7).fill(texture, cv::RNG::UNIFORM, 0, 255);
    cv::GaussianBlur(texture, texture, {}, 3.0);
    for (int i = 0; i < pictures; ++i) {
      const fs::path file = guest_.out() / "pictures" / (std::to_string(1000 + i) + ".jpg");
      cv::imwrite(file.string(), texture(cv::Rect(step * i, 0, width, height)).clone());
      recorded_.insert(sha256(read_file(file).value()));
    }
  }

  void expect_recorded() const {
    for (const FrameId& frame : frames_) {
      EXPECT_TRUE(recorded_.contains(sha256(read_file(bundles_[0].frame(frame.pass, frame.index)).value())))
          << frame.index << " differs from the recording";
    }
  }

  std::set<std::string> recorded_;
};

TEST_F(WholeUsbScanSlow, KeepsItsPicturesByteForByte) {
  record_pictures();
  scan("plug_in $OUT/pictures 320 240 20\n", "");
  expect_recorded();
}

TEST_F(WholeUsbScanSlow, GoesOnWhenTheCameraWasPulledOutAndPutBack) {
  record_pictures();
  scan("plug_in $OUT/pictures 320 240 20\n", "", R"sh(
      pull_out
      until_true 30 grep -qE 'starting its stream again|opening it again' $OUT/device
      plug_in $OUT/pictures 320 240 20
      spooled=$(ls $OUT/spool/*/frames | wc -l)
      until_true 90 eval '[ $(ls $OUT/spool/*/frames | wc -l) -ge $((spooled + 3)) ]'
  )sh");
  expect_recorded();
  EXPECT_EQ(said("device").find(": fault"), std::string::npos) << said("device");
}

}  // namespace
}  // namespace gyre
