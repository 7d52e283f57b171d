// SPDX-License-Identifier: Apache-2.0
// Whole scans with a camera that fails: gyre-device records them from a recording with a fault script.
#include "common/bundle/atomic_file.h"
#include "common/bundle/bundle.h"
#include "tests/system/programs.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace gyre {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int frames = 180;

class CameraFaults : public testing::Test {
 protected:
  // A walk along a texture, as pictures that are too many to be photographs.
  void SetUp() override {
    constexpr int width = 96;
    constexpr int height = 64;
    constexpr int step = 2;  // pixels a frame
    cv::Mat texture(height, width + step * frames, CV_8UC3);
    cv::RNG(11).fill(texture, cv::RNG::UNIFORM, 0, 255);
    cv::GaussianBlur(texture, texture, {}, 2.0);
    fs::create_directories(pictures());
    for (int i = 0; i < frames; ++i)
      cv::imwrite((pictures() / (std::to_string(i) + ".jpg")).string(),
                  texture(cv::Rect(step * i, 0, width, height)).clone());
  }

  fs::path pictures() const { return folder_.path() / "pictures"; }

  // Makes a scan; faults: entries of a script, or empty for none at all.
  Finished scan(const std::string& name, const std::string& faults) {
    std::string camera = pictures().string();
    if (!faults.empty()) {
      const fs::path script = folder_.path() / (name + ".json");
      EXPECT_TRUE(write_file(script, std::string_view("{\"faults\": [" + faults + "]}")));
      camera += "?faults=" + script.string();
    }
    return run_program("gyre-device", {"replay", camera, "--spool", (folder_.path() / name).string(), "--keys",
                                       (folder_.path() / "keys").string()});
  }

  fs::path bundle(const std::string& name, const Finished& finished) const {
    return folder_.path() / name / json::parse(last_line(finished.out)).at("scan").get<std::string>();
  }

  // Names and bytes of the keyframes.
  static std::map<std::string, std::string> keyframes(const fs::path& bundle) {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::directory_iterator(bundle / "frames"))
      files[entry.path().filename().string()] = read_file(entry.path()).value();
    return files;
  }

  TemporaryFolder folder_;
};

TEST_F(CameraFaults, WhatOnlyInterruptsLeavesTheSameKeyframes) {
  const Finished plain = scan("plain", "");
  ASSERT_EQ(plain.code, 0) << plain.err;
  const auto expected = keyframes(bundle("plain", plain));
  ASSERT_GE(expected.size(), 20U);
  const std::map<std::string, std::string> interruptions = {
      {"none", R"({"before_frame": 170, "kind": "late", "seconds": 0.1})"},
      {"silence", R"({"before_frame": 50, "kind": "silence", "until": "restart"})"},
      {"reopen", R"({"before_frame": 50, "kind": "broken", "until": "reopen"})"},
      {"unplugged", R"({"before_frame": 90, "kind": "gone", "seconds": 25})"},
      {"all", R"({"before_frame": 20, "kind": "broken", "until": "restart"},
                 {"before_frame": 60, "kind": "silence", "until": "reopen"},
                 {"before_frame": 100, "kind": "gone", "seconds": 15},
                 {"before_frame": 101, "kind": "silence", "until": "restart"})"}};
  for (const auto& [name, faults] : interruptions) {
    const Finished finished = scan(name, faults);
    ASSERT_EQ(finished.code, 0) << name << ": " << finished.err;
    EXPECT_EQ(keyframes(bundle(name, finished)), expected) << name;
    const Result<void> verified = verify_bundle(Bundle(bundle(name, finished)));
    EXPECT_TRUE(verified) << name << ": " << verified.error().message();
  }
}

TEST_F(CameraFaults, LostFramesCostNoMoreThanThemselves) {
  const Finished finished = scan("lost", R"({"before_frame": 30, "kind": "missing", "frames": 4},
                                            {"before_frame": 80, "kind": "torn", "frames": 3})");
  ASSERT_EQ(finished.code, 0) << finished.err;
  const Bundle lost(bundle("lost", finished));
  const Result<void> verified = verify_bundle(lost);
  EXPECT_TRUE(verified) << verified.error().message();
  EXPECT_EQ(read_frame_log(lost)->size(), static_cast<std::size_t>(frames - 7));
}

TEST_F(CameraFaults, ACameraThatStaysAwayEndsTheProgramWithAReason) {
  const Finished finished = scan("away", R"({"before_frame": 50, "kind": "gone", "until": "never"})");
  EXPECT_EQ(finished.code, 1);
  EXPECT_NE(finished.err.find("does not come back"), std::string::npos) << finished.err;
}

TEST_F(CameraFaults, AWrongScriptIsWrongUse) {
  const Finished finished = scan("wrong", R"({"before_frame": 50, "kind": "tired"})");
  EXPECT_EQ(finished.code, 2);
  EXPECT_NE(finished.err.find("fault 1"), std::string::npos) << finished.err;
}

}  // namespace
}  // namespace gyre
