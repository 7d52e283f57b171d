// SPDX-License-Identifier: Apache-2.0
// A rig that records one scan after another, whose power goes at random moments: the daemon is killed, and its spool is
// what was synced and no more, or that and by chance some of what was not. No keyframe that the host has acknowledged
// is missing then, nothing half is to be seen, and the next start is clean and says what it found. The seed is printed;
// GYRE_FAULT_SEED sets it, and GYRE_CUTS how often the power goes.
#include "common/bundle/atomic_file.h"
#include "common/bundle/bundle.h"
#include "common/keys/keys.h"
#include "tests/system/platter.h"
#include "tests/system/programs.h"
#include "tests/system/spool_view.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <httplib.h>
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <optional>
#include <random>
#include <thread>

namespace gyre {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

// Of a scan from its start to its avatar, and what a slow machine takes longer.
constexpr int scan_ms = 6000;
constexpr int scan_syncs = 250;

class PowerCut : public testing::Test {
 protected:
  void SetUp() override {
    const char* const seed = std::getenv("GYRE_FAULT_SEED");
    seed_ = seed != nullptr ? static_cast<unsigned>(std::stoul(seed)) : std::random_device{}();
    std::printf("GYRE_FAULT_SEED=%u\n", seed_);
    std::fflush(stdout);
    for (const char* const folder : {"host", "keys", "spool", "platter"}) fs::create_directories(root_ / folder);
    platter_.emplace(root_ / "platter", spool());
    platter_->sync_all();
    const KeyPair host = make_key_pair(), device = make_key_pair();
    ASSERT_TRUE(write_key_pair(root_ / "host" / "host.key", host));
    ASSERT_TRUE(write_public_key(root_ / "keys" / "host.pub", host.public_key));
    ASSERT_TRUE(write_key_pair(root_ / "keys" / "device.key", device));
    ASSERT_TRUE(authorise_device(root_ / "host" / "devices", "rig", device.public_key));
    host_ = std::make_unique<Running>("fault_peer",
                                      std::vector<std::string>{"host", (root_ / "host").string(), "tcp://127.0.0.1:*"},
                                      root_ / "host.out", root_ / "host.log");
    endpoint_ = first_line(root_ / "host.out", *host_);
    record();
  }

  // A walk along a texture, a second and a half of it.
  void record() const {
    constexpr int width = 320, height = 240, frames = 90, step = 4;
    cv::Mat texture(height, width + step * frames, CV_8UC3);
    cv::RNG(7).fill(texture, cv::RNG::UNIFORM, 0, 255);
    cv::GaussianBlur(texture, texture, {}, 3.0);
    cv::VideoWriter video((root_ / "walk.avi").string(), cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 60.0,
                          {width, height});
    for (int i = 0; i < frames; ++i) video.write(texture(cv::Rect(step * i, 0, width, height)));
  }

  fs::path spool() const { return root_ / "spool"; }
  fs::path received() const { return root_ / "host" / "store" / "scans"; }
  std::string log() const { return read_file(root_ / "device.log").value_or(""); }

  // cut_at_sync: see sync_shim.cpp; 0: none.
  void start_device(long cut_at_sync) {
    fs::remove(root_ / "device.log");
    const std::vector<std::pair<const char*, std::string>> environment = {
        {"LD_PRELOAD", GYRE_SYNC_SHIM},
        {"GYRE_PLATTER", (root_ / "platter").string()},
        {"GYRE_PLATTER_ROOT", spool().string()},
        {"GYRE_CUT_AT_SYNC", std::to_string(cut_at_sync)}};
    for (const auto& [name, value] : environment) ::setenv(name, value.c_str(), 1);
    device_ = std::make_unique<Running>(
        "gyre-device",
        std::vector<std::string>{"run", "--camera", "replay:" + (root_ / "walk.avi").string(), "--spool",
                                 spool().string(), "--host", endpoint_, "--keys", (root_ / "keys").string(),
                                 "--height-mm", "1700", "--page", "127.0.0.1:0"},
        root_ / "device.out", root_ / "device.log");
    for (const auto& [name, value] : environment) ::unsetenv(name);
    page_.reset();
  }

  // Whether the device has told so before it ended or the time was over.
  bool hears(const std::string& text, Clock::time_point until = Clock::time_point::max()) {
    while (log().find(text) == std::string::npos) {
      if (device_->ended() || Clock::now() > until) return false;
      std::this_thread::sleep_for(milliseconds(5));
    }
    return true;
  }

  httplib::Client& page() {
    if (!page_) {
      const std::string said = log(), phrase = "page is on ";
      const std::size_t begin = said.find(phrase) + phrase.size();
      page_ = std::make_unique<httplib::Client>(said.substr(begin, said.find("/\n", begin) - begin));
      page_->set_default_headers({{"X-Gyre", "1"}});
    }
    return *page_;
  }

  // Takes one scan after another until the device ends or the time is over; `most` of them from now on.
  void operate(Clock::time_point until, int most) {
    int begun = 0;
    std::string last;
    while (!device_->ended() && Clock::now() < until) {
      const auto status = page().Get("/api/status");
      if (!status) continue;
      const nlohmann::json said = nlohmann::json::parse(status->body);
      const std::string state = said["state"];
      const bool is_over = state == "idle" || state == "avatar_ready";
      if (is_over && begun == most) return;
      ASSERT_NE(state, "fault") << said["fault"] << log();
      if (is_over || state == "between_passes") {
        if (is_over && state != last) ++begun;
        // Now and then a scan without its second pass.
        const bool is_enough = state == "between_passes" && below(4) == 0;
        page().Post("/api/commands", is_enough ? R"({"command":"cancel"})" : R"({"command":"start"})",
                    "application/json");
      }
      last = state;
      std::this_thread::sleep_for(milliseconds(10));
    }
  }

  // Scans of before the cuts are delivered beside the newest; one that is not after a minute never will be.
  void await_avatars() const {
    const auto until = Clock::now() + std::chrono::minutes(1);
    const auto waits = [](const auto& scan) {
      return scan.second.phase == SpoolPhase::closed || scan.second.phase == SpoolPhase::acknowledged;
    };
    for (;;) {
      const SpoolView view = view_spool(spool());
      if (std::none_of(view.scans.begin(), view.scans.end(), waits) || Clock::now() > until) return;
      std::this_thread::sleep_for(milliseconds(50));
    }
  }

  // The device has started after a cut that left `before`.
  void expect_clean_start(const SpoolView& before) {
    const std::string said = log();
    EXPECT_EQ(said.find(" error "), std::string::npos) << said;
    const SpoolView after = view_spool(spool());
    expect_tidy(after, spool());
    expect_explained(before, after, said);
    auto health = page().Get("/health");
    while (!health && !device_->ended()) health = page().Get("/health");
    EXPECT_TRUE(!health || health->status == 200) << said;
  }

  void run(int cuts) {
    if (const char* const asked = std::getenv("GYRE_CUTS")) cuts = std::stoi(asked);
    SpoolView before;
    int in_time = 0, at_sync = 0;
    for (int i = 0; i < cuts && !HasFailure(); ++i) {
      random_.seed(seed_ + static_cast<unsigned>(i));
      SCOPED_TRACE("cut " + std::to_string(i) + " of seed " + std::to_string(seed_));
      const bool is_at_sync = below(2) == 0;
      const long sync = 1 + static_cast<long>(below(scan_syncs));
      const auto until = Clock::now() + milliseconds(is_at_sync ? 4 * scan_ms : static_cast<int>(below(scan_ms)));
      start_device(!is_at_sync ? 0 : below(2) == 0 ? sync : -sync);
      if (hears("waiting for the button", until)) {
        expect_clean_start(before);
        operate(until, 1 << 20);
      }
      ++(device_->ended() ? at_sync : in_time);
      device_->kill_hard();
      // As far as anybody has been told, and what is left of it.
      expect_whole(view_spool(spool()).acknowledged(), received());
      platter_->cut(below(2) == 0 ? nullptr : &random_);
      before = view_spool(spool());
      expect_whole(before.keyframes(), spool());
      expect_whole(before.acknowledged(), received());
      for (const auto& [name, hash] : before.acknowledged()) ever_acknowledged_[name] = hash;
    }
    std::printf("cuts: %d at a moment, %d at a sync; acknowledged meanwhile: %zu keyframes\n", in_time, at_sync,
                ever_acknowledged_.size());
    start_device(0);
    ASSERT_TRUE(hears("waiting for the button")) << log();
    expect_clean_start(before);
    operate(Clock::time_point::max(), 1);
    await_avatars();
    ASSERT_EQ(device_->stop(), 0) << log();
    host_->kill_hard();
    const SpoolView all = view_spool(spool());
    expect_tidy(all, spool());
    const int scans = expect_delivered(all, ever_acknowledged_, received());
    std::printf("scans: %d\n", scans);
    EXPECT_GT(scans, 0);
  }

  std::uint64_t below(std::uint64_t n) { return random_() % n; }

  TemporaryFolder folder_;
  fs::path root_ = folder_.path();
  unsigned seed_ = 0;
  std::mt19937 random_;
  std::optional<Platter> platter_;
  std::string endpoint_;
  std::unique_ptr<Running> host_, device_;
  std::unique_ptr<httplib::Client> page_;
  SpoolView::Files ever_acknowledged_;
};

TEST_F(PowerCut, FiveCutsLoseNothing) {
  run(5);
}

TEST_F(PowerCut, SlowFiftyCutsLoseNothing) {
  run(50);
}

}  // namespace
}  // namespace gyre
