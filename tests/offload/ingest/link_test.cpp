// SPDX-License-Identifier: Apache-2.0
// Device and host over a real socket, when nothing goes wrong.
#include "common/bundle/atomic_file.h"
#include "common/bundle/sha256.h"
#include "device/uplink/link_metrics.h"
#include "tests/offload/ingest/link_support.h"

#include <gtest/gtest.h>
#include <thread>

namespace gyre {
namespace {

const ResultWait patience{std::chrono::seconds(60), std::chrono::seconds(60)};

class Link : public testing::Test {
 protected:
  void SetUp() override {
    host_.authorise(device_.options().keys);
    host_.start();
    device_.connect(host_);
  }
  TestHost host_;
  TestDevice device_{"rig"};
};

TEST_F(Link, AScanGoesUpAndItsAvatarComesBack) {
  const Scan scan = small_scan();
  ASSERT_TRUE(spool_scan(device_.spool(), scan, {2, 5, 9}, 300'000, 1));
  ASSERT_TRUE(eventually([&] { return host_.queued() == std::vector{scan.id}; }));
  EXPECT_TRUE(verify_bundle(host_.store().bundle(scan.id)));
  EXPECT_FALSE(std::filesystem::exists(host_.store().incoming(scan.id)));
  std::thread pipeline([&] {
    host_.server().publish_progress(scan.id, "cloud", 0.5, "half way");
    host_.run_jobs();
  });
  const Result<void> result = device_.uplink().wait_for_result(scan.id, patience);
  pipeline.join();
  ASSERT_TRUE(result) << result.error().message();
  EXPECT_EQ(read_file(device_.spool().bundle(scan.id).root() / "avatar.glb").value(),
            avatar_of(host_.store().bundle(scan.id)));
  EXPECT_EQ(avatar_of(device_.spool().bundle(scan.id)), avatar_of(host_.store().bundle(scan.id)));
  EXPECT_TRUE(std::filesystem::exists(device_.spool().bundle(scan.id).root() / "report.json"));
  EXPECT_TRUE(eventually([&] { return host_.store().scan(scan.id).value()->delivered; }));
}

TEST_F(Link, KeyframesLeaveWhileTheScanIsRecorded) {
  const Scan scan = small_scan();
  ASSERT_TRUE(device_.spool().open_scan(scan));
  ASSERT_TRUE(device_.spool().add_file(scan.id, keyframe_name(1), small_keyframe(1, 5000)));
  ASSERT_TRUE(device_.spool().add_file(scan.id, keyframe_name(2), small_keyframe(2, 5000)));
  const auto stored = [&](int index) { return host_.store().file(scan.id, keyframe_name(index)).value().has_value(); };
  ASSERT_TRUE(eventually([&] { return stored(1) && stored(2); }));
  ASSERT_TRUE(device_.spool().discard(scan.id, keyframe_name(1)));
  ASSERT_TRUE(eventually([&] { return !stored(1); }));
  ASSERT_TRUE(device_.spool().add_file(scan.id, keyframe_name(3), small_keyframe(3, 5000)));
  ASSERT_TRUE(device_.spool().close_scan(scan, small_records(4, {2, 3})));
  ASSERT_TRUE(eventually([&] { return host_.queued().size() == 1; }));
  EXPECT_TRUE(verify_bundle(host_.store().bundle(scan.id)));
  EXPECT_EQ(list_frames(host_.store().bundle(scan.id))->size(), 2U);
}

TEST_F(Link, TheDeviceHearsOfProgressAndFailure) {
  const Scan scan = small_scan();
  ASSERT_TRUE(spool_scan(device_.spool(), scan, {1}, 1000, 1));
  bool asked = false;
  const Result<void> result = device_.uplink().wait_for_result(scan.id, patience, [&](const ScanProgress& progress) {
    if (progress.stage == "queued" && !asked) {
      asked = true;
      host_.server().publish_progress(scan.id, "cameras", 0.25, "pair 3 of 12");
    }
    if (progress.stage == "cameras") {
      EXPECT_EQ(progress.fraction, 0.25);
      EXPECT_EQ(progress.text, "pair 3 of 12");
      EXPECT_TRUE(host_.server().publish_failure(scan.id, "no features found"));
    }
  });
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().message().find("no features found"), std::string::npos);
  EXPECT_EQ(device_.spool().phase(scan.id), SpoolPhase::failed);
}

// A device that only listens is not taken for gone.
TEST_F(Link, AHostThatTalksAllTheTimeHearsThatTheDeviceIsThere) {
  constexpr std::chrono::seconds silence{3};
  device_.disconnect();
  host_.stop();
  host_.set_silence_timeout(silence);
  host_.start();
  device_.connect(host_);
  const Scan scan = small_scan();
  ASSERT_TRUE(spool_scan(device_.spool(), scan, {1}, 1000, 1));
  ASSERT_TRUE(eventually([&] { return host_.queued().size() == 1; }));
  const auto begun = std::chrono::steady_clock::now();
  for (double fraction = 0.0; std::chrono::steady_clock::now() - begun < 2 * silence; fraction += 1e-6) {
    host_.server().publish_progress(scan.id, "cameras", fraction, "");
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  EXPECT_EQ(device_.uplink().counts().connections, 1U);
  EXPECT_EQ(device_.uplink().counts().lost, 0U);
}

TEST_F(Link, ABundleThatCannotBeUsedFailsTheScan) {
  const Scan scan = small_scan();
  ASSERT_TRUE(device_.spool().open_scan(scan));
  const std::vector<std::byte> no_picture(1000, std::byte{7});
  ASSERT_TRUE(device_.spool().add_file(scan.id, keyframe_name(1), no_picture));
  ASSERT_TRUE(device_.spool().close_scan(scan, small_records(2, {1})));
  const Result<void> result = device_.uplink().wait_for_result(scan.id, patience);
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().message().find("cannot be decoded"), std::string::npos);
  EXPECT_TRUE(host_.queued().empty());
}

TEST_F(Link, AResultThatIsDoneWhileTheDeviceIsAwayIsFetchedLater) {
  const Scan scan = small_scan();
  ASSERT_TRUE(spool_scan(device_.spool(), scan, {1, 2}, 1000, 1));
  ASSERT_TRUE(eventually([&] { return device_.spool().phase(scan.id) == SpoolPhase::acknowledged; }));
  device_.stop();
  host_.run_jobs();
  host_.stop();
  host_.start();
  device_.connect(host_);
  ASSERT_TRUE(device_.uplink().wait_for_result(scan.id, patience));
  EXPECT_EQ(read_file(device_.spool().bundle(scan.id).root() / "avatar.glb").value(),
            avatar_of(host_.store().bundle(scan.id)));
}

TEST_F(Link, AHostThatLostItsStoreGetsEverythingAgain) {
  const Scan scan = small_scan();
  ASSERT_TRUE(spool_scan(device_.spool(), scan, {1, 2}, 1000, 1));
  ASSERT_TRUE(eventually([&] { return device_.spool().phase(scan.id) == SpoolPhase::acknowledged; }));
  const std::filesystem::path store = host_.store().folder();
  host_.stop();
  std::filesystem::remove_all(store);
  host_.start();
  ASSERT_TRUE(eventually([&] { return host_.queued().size() == 2; }));
  host_.run_jobs();
  ASSERT_TRUE(device_.uplink().wait_for_result(scan.id, patience));
}

TEST_F(Link, TheHostIsToldHowTheDeviceIsAndBothCount) {
  const Scan scan = small_scan();
  ASSERT_TRUE(device_.spool().open_scan(scan));
  device_.uplink().tell("recording", "walk on to the left", scan.id);
  device_.uplink().tell({scan.id, "body", {{"body upper", 0.5, std::string("\xff\0", 2)}}});
  const auto seen = [&] { return host_.server().board().device(device_.options().keys.public_key); };
  ASSERT_TRUE(eventually([&] { return seen() && seen()->status && seen()->status->text == "walk on to the left"; }));
  EXPECT_TRUE(seen()->connected);
  EXPECT_EQ(seen()->status->scan, scan.id);
  EXPECT_GT(seen()->status->free_bytes, 0U);
  // A preview that came before its scan was opened was not taken; there is always a next one.
  ASSERT_TRUE(eventually([&] {
    device_.uplink().tell({scan.id, "body", {{"body upper", 0.5, std::string("\xff\0", 2)}}});
    return seen()->coverage.has_value();
  }));
  EXPECT_EQ(seen()->coverage->bands.at(0).share, 0.5);

  ASSERT_TRUE(device_.spool().add_file(scan.id, keyframe_name(1), small_keyframe(1, 5000)));
  ASSERT_TRUE(device_.spool().close_scan(scan, small_records(2, {1})));
  ASSERT_TRUE(eventually([&] { return device_.spool().phase(scan.id) == SpoolPhase::acknowledged; }));
  const LinkCounts& counts = host_.server().board().counts;
  EXPECT_EQ(counts.received_frames, 1U);
  EXPECT_EQ(counts.received_files, 3U);
  Metrics metrics;
  add_link_metrics(metrics, device_.spool(), &device_.uplink());
  const std::string told = metrics.expose();
  for (const char* line :
       {"gyre_uplink_connected 1\n", "gyre_uplink_connections_total 1\n", "gyre_spooled_frames_total 1\n",
        "gyre_acknowledged_files_total 3\n", "gyre_spool_waiting_files 0\n"}) {
    EXPECT_NE(told.find(line), std::string::npos) << line << told;
  }
}

TEST_F(Link, SeveralDevicesAndScansAtOnce) {
  std::vector<std::unique_ptr<TestDevice>> devices;
  std::vector<std::vector<std::string>> scans(3);
  for (std::size_t d = 0; d < scans.size(); ++d) {
    devices.push_back(std::make_unique<TestDevice>("rig-" + std::to_string(d)));
    host_.authorise(devices.back()->options().keys);
    devices.back()->connect(host_);
  }
  for (std::size_t d = 0; d < scans.size(); ++d) {
    for (int s = 0; s < 3; ++s) {
      const Scan scan = small_scan();
      scans[d].push_back(scan.id);
      ASSERT_TRUE(
          spool_scan(devices[d]->spool(), scan, {1, 2, 3}, 20'000, 100 * d + 10 * static_cast<std::uint64_t>(s)));
    }
  }
  ASSERT_TRUE(eventually([&] { return host_.queued().size() == 9; }));
  host_.run_jobs();
  for (std::size_t d = 0; d < scans.size(); ++d) {
    for (const std::string& scan : scans[d]) {
      ASSERT_TRUE(devices[d]->uplink().wait_for_result(scan, patience));
      EXPECT_EQ(read_file(devices[d]->spool().bundle(scan).root() / "avatar.glb").value(),
                avatar_of(devices[d]->spool().bundle(scan)));
    }
  }
}

TEST_F(Link, WaitingForAHostThatIsGoneEndsAndKeepsTheScan) {
  host_.stop();
  const Scan scan = small_scan();
  ASSERT_TRUE(spool_scan(device_.spool(), scan, {1}, 1000, 1));
  const ResultWait short_patience{std::chrono::milliseconds(50), std::chrono::seconds(60)};
  const Result<void> result = device_.uplink().wait_for_result(scan.id, short_patience);
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().message().find("not reachable"), std::string::npos) << result.error().message();
  EXPECT_NE(result.error().message().find("the scan is kept in"), std::string::npos);
  EXPECT_TRUE(verify_bundle(device_.spool().bundle(scan.id)));
  host_.start();
  ASSERT_TRUE(eventually([&] { return device_.spool().phase(scan.id) == SpoolPhase::acknowledged; }));
}

}  // namespace
}  // namespace gyre
