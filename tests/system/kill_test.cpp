// SPDX-License-Identifier: Apache-2.0
// Device or host killed at ten random moments: the same avatar comes out, no keyframe is lost or doubled.
#include "common/bundle/atomic_file.h"
#include "common/bundle/bundle.h"
#include "common/bundle/sha256.h"
#include "tests/system/programs.h"

#include <gtest/gtest.h>
#include <unistd.h>
#include <nlohmann/json.hpp>
#include <random>

namespace gyre {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// One device and one host with folders of their own on a fixed port.
class Rig {
 public:
  Rig(fs::path root, std::string capture) : root_(std::move(root)), capture_(std::move(capture)) {
    fs::create_directories(root_ / "host");
    start_host();
    const Finished device =
        run_program("gyre-device", {"pair", "--keys", at("keys"), "--host-public-key", public_key_});
    const std::string key = json::parse(device.out).at("device_public_key");
    EXPECT_EQ(run_program("gyre-offload", {"pair", "--store", at("host"), "--authorise", key, "--name", "rig"}).code,
              0);
    start_device();
  }

  void start_host() {
    fs::remove(root_ / "ready.json");
    host_ = std::make_unique<Running>("gyre-offload",
                                      std::vector<std::string>{"serve", "--store", at("host"), "--endpoint", endpoint_,
                                                               "--page", "off", "--texture-size", "1024"},
                                      root_ / "ready.json", root_ / "host.log");
    const json ready = json::parse(first_line(root_ / "ready.json", *host_));
    endpoint_ = ready.at("endpoint");
    public_key_ = ready.at("public_key");
  }
  void start_device() {
    device_ = std::make_unique<Running>(
        "gyre-device",
        std::vector<std::string>{"replay", capture_, "--height-mm", "1700", "--host", endpoint_, "--keys", at("keys"),
                                 "--spool", at("spool"), "--out", at("out")},
        root_ / "device.out", root_ / "device.log");
  }
  Running& device() { return *device_; }
  Running& host() { return *host_; }

  std::string avatar() const { return read_file(root_ / "out" / "avatar.glb").value_or(""); }
  json summary() const { return json::parse(last_line(read_file(root_ / "device.out").value_or("")), nullptr, false); }
  // Name and hash of every keyframe the host has, of every scan it has.
  std::vector<std::string> keyframes() const {
    std::vector<std::string> all;
    for (const auto& scan : fs::directory_iterator(root_ / "host" / "scans")) {
      for (const FrameId& id : list_frames(Bundle(scan.path())).value_or(std::vector<FrameId>())) {
        all.push_back(frame_name(id.pass, id.index) + " " +
                      sha256_of_file(Bundle(scan.path()).frame(id.pass, id.index)).value_or("?"));
      }
    }
    return all;
  }
  std::string log() const {
    return read_file(root_ / "device.log").value_or("") + read_file(root_ / "host.log").value_or("");
  }

 private:
  std::string at(const std::string& name) const { return (root_ / name).string(); }

  fs::path root_;
  std::string capture_, endpoint_ = "tcp://127.0.0.1:*", public_key_;
  std::unique_ptr<Running> host_, device_;
};

TEST(KillTest, TenKillsEndWithTheSameAvatar) {
  const fs::path root = fs::path(testing::TempDir()) / ("kill-" + std::to_string(::getpid()));
  const std::string capture = (root / "capture").string();
  ASSERT_EQ(run_program("synthetic_capture",
                        {capture, "--sequence", "orbit-body", "--frames", "90", "--width", "270", "--height", "480"})
                .code,
            0);
  const std::string video = capture + "/video.mp4";

  const auto begin = std::chrono::steady_clock::now();
  Rig calm(root / "calm", video);
  ASSERT_EQ(calm.device().wait(), 0) << calm.log();
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  ASSERT_FALSE(calm.avatar().empty());
  calm.host().stop();

  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  constexpr int kills = 10;
  Rig rough(root / "rough", video);
  for (int i = 0; i < kills && !rough.device().ended(); ++i) {
    // Some of the moments fall into the recording, the others anywhere in the whole run.
    std::uniform_real_distribution<double> when(0.0, i % 2 == 0 ? 0.05 * seconds : 0.3 * seconds);
    std::this_thread::sleep_for(std::chrono::duration<double>(when(random)));
    if (random() % 2 == 0) {
      rough.host().kill_hard();
      rough.start_host();
    } else if (!rough.device().ended()) {
      rough.device().kill_hard();
      rough.start_device();
    }
  }
  ASSERT_EQ(rough.device().wait(), 0) << rough.log();
  EXPECT_EQ(rough.keyframes(), calm.keyframes());
  EXPECT_TRUE(rough.avatar() == calm.avatar()) << rough.log();
  EXPECT_EQ(rough.summary().at("keyframes"), calm.summary().at("keyframes"));
  fs::remove_all(root);
}

}  // namespace
}  // namespace gyre
