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

class PanelGuestSlow : public PanelGuest {};

TEST_F(PanelGuest, AThousandBouncingPressesAreAThousandEvents) {
  ASSERT_TRUE(write_file(guest_.out() / "bounce.py", std::string_view(R"(
import sys, time
line = open(sys.argv[1], "w", buffering=1)
def pull(way):
    line.write(way + "\n")
    line.seek(0)
for press in range(1000):
    for ways in (("pull-down", "pull-up"), ("pull-up", "pull-down")):
        for bounce in range(press % 7):
            for way in ways:
                pull(way)
                time.sleep(0.0005 * (1 + (press + bounce) % 3))
        pull(ways[0])
        time.sleep(0.03 + 0.01 * (press % 5))
)")));
  const int code = guest_.run(R"(
    plug_panel
    $BIN/gyre-device panel --button '!GYRE_BUTTON' --debounce-ms 10 >$OUT/presses 2>$OUT/panel & daemon=$!
    until_true 20 grep -q 'press the button' $OUT/panel
    python3 $OUT/bounce.py $panel/sim_gpio2/pull
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

// With a USB camera that serves recorded pictures, and a host: from the button to keyframes that the host has.
TEST_F(PanelGuestSlow, AWholeScanFromTheButtonToTheHost) {
  std::set<std::string> recorded;
  fs::create_directories(guest_.out() / "pictures");
  constexpr int width = 320, height = 240, pictures = 240, step = 4;
  cv::Mat texture(height, width + step * pictures, CV_8UC3);
  cv::RNG(7).fill(texture, cv::RNG::UNIFORM, 0, 255);
  cv::GaussianBlur(texture, texture, {}, 3.0);
  for (int i = 0; i < pictures; ++i) {
    const fs::path file = guest_.out() / "pictures" / (std::to_string(1000 + i) + ".jpg");
    cv::imwrite(file.string(), texture(cv::Rect(step * i, 0, width, height)).clone());
    recorded.insert(sha256(read_file(file).value()));
  }
  const int code = guest_.run(R"sh(
    plug_panel
    plug_in $OUT/pictures 320 240 20
    $BIN/gyre-offload serve --store /tmp/host --endpoint 'tcp://127.0.0.1:7410' --page off >$OUT/ready 2>$OUT/host &
    until_true 60 grep -q public_key $OUT/ready
    field() { python3 -c 'import json,sys; print(json.loads(sys.stdin.readline())[sys.argv[1]])' $1; }
    $BIN/gyre-device pair --keys /tmp/keys --host-public-key "$(field public_key <$OUT/ready)" >$OUT/pair
    $BIN/gyre-offload pair --store /tmp/host --authorise "$(field device_public_key <$OUT/pair)" --name rig
    printf '[run]\ncamera = "v4l2:/dev/video0"\nhost = "tcp://127.0.0.1:7410"\nkeys = "/tmp/keys"\n' >/tmp/rig.toml
    printf 'spool = "%s/spool"\nheight-mm = 1700\n[panel]\nbutton = "!GYRE_BUTTON"\n' "$OUT" >>/tmp/rig.toml
    printf 'red = "GYRE_RED"\ngreen = "GYRE_GREEN"\nblue = "GYRE_BLUE"\n' >>/tmp/rig.toml
    $BIN/gyre-device --config /tmp/rig.toml run 2>$OUT/device & daemon=$!
    until_true 60 eval '[ $(lights) = 111 ]'
    press 0.2
    until_true 30 grep -q 'arming on .*: pass' $OUT/device
    sleep 8
    press 0.2
    until_true 30 grep -q ': between_passes' $OUT/device
    press 1.5
    until_true 30 grep -q ': waiting_for_host' $OUT/device
    until_true 60 grep -q '"acknowledged"' $OUT/spool/*/spool.jsonl
    kill -TERM $daemon
    wait $daemon
    [ $(lights) = 000 ]
  )sh");
  EXPECT_EQ(code, 0) << guest_.log() << said("device") << said("host");
  int bundles = 0;
  for (const auto& entry : fs::directory_iterator(guest_.out() / "spool")) {
    if (!fs::exists(entry.path() / "scan.json")) continue;
    ++bundles;
    const Bundle bundle(entry.path());
    const Result<void> verified = verify_bundle(bundle);
    EXPECT_TRUE(verified) << verified.error().message();
    const std::vector<FrameId> frames = list_frames(bundle).value();
    EXPECT_GE(frames.size(), 20U);
    for (const FrameId& frame : frames) {
      EXPECT_TRUE(recorded.contains(sha256(read_file(bundle.frame(frame.pass, frame.index)).value())))
          << frame.index << " differs from the recording";
    }
  }
  EXPECT_EQ(bundles, 1);
}

}  // namespace
}  // namespace gyre
