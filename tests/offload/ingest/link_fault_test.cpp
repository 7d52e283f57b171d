// SPDX-License-Identifier: Apache-2.0
// Either side goes down at random moments; nothing is lost, nothing doubled.
#include "common/bundle/atomic_file.h"
#include "common/bundle/sha256.h"
#include "tests/offload/ingest/link_support.h"

#include <gtest/gtest.h>
#include <random>

namespace gyre {
namespace {

class Fault : public testing::TestWithParam<unsigned> {};

TEST_P(Fault, NothingIsLostOrDoubled) {
  std::mt19937 random(GetParam());
  TestHost host;
  TestDevice device("rig");
  host.authorise(device.options().keys);
  host.set_credit(1 << 20);
  host.start();
  device.connect(host);

  const Scan scan = small_scan();
  constexpr int frames = 24;
  constexpr std::size_t frame_bytes = 600'000;
  std::vector<int> chosen;
  ASSERT_TRUE(device.spool().open_scan(scan));
  for (int i = 0; i < frames; ++i) {
    ASSERT_TRUE(
        device.spool().add_file(scan.id, keyframe_name(i), small_keyframe(static_cast<std::uint64_t>(i), frame_bytes)));
    if (i % 5 == 4) {
      ASSERT_TRUE(device.spool().discard(scan.id, keyframe_name(i)));
    } else {
      chosen.push_back(i);
    }
    if (random() % 6 != 0) continue;
    // Goes down once a random number of bytes more has reached the host's disk, mid-file as likely as not.
    const std::uint64_t goal = bytes_below(host.store().folder()) + random() % 900'000;
    ASSERT_TRUE(eventually([&] {
      const SpooledScan now = *device.spool().scan(scan.id);
      const bool all = std::all_of(now.files.begin(), now.files.end(),
                                   [](const SpooledFile& f) { return f.phase != SpooledFilePhase::spooled; });
      return all || bytes_below(host.store().folder()) >= goal;
    }));
    if (random() % 2 == 0) {
      device.stop();
      device.connect(host);
    } else {
      host.stop();
      host.start();
    }
  }
  ASSERT_TRUE(device.spool().close_scan(scan, small_records(frames, chosen)));
  for (int restarts = 0; host.queued().empty(); ++restarts) {
    ASSERT_LT(restarts, 1000);
    if (restarts < 6) {
      if (random() % 2 == 0) {
        device.stop();
        device.connect(host);
      } else {
        host.stop();
        host.start();
      }
    }
    const std::uint64_t goal = bytes_below(host.store().folder()) + random() % 2'000'000;
    ASSERT_TRUE(eventually([&] { return !host.queued().empty() || bytes_below(host.store().folder()) >= goal; }));
  }
  host.run_jobs();
  device.stop();
  device.connect(host);
  const Result<void> result =
      device.uplink().wait_for_result(scan.id, {std::chrono::seconds(60), std::chrono::seconds(60)});
  ASSERT_TRUE(result) << result.error().message();

  EXPECT_EQ(host.queued(), std::vector{scan.id});
  const Bundle sent = device.spool().bundle(scan.id);
  const Bundle received = host.store().bundle(scan.id);
  EXPECT_TRUE(verify_bundle(received));
  EXPECT_EQ(list_frames(received).value(), list_frames(sent).value());
  EXPECT_EQ(list_frames(received)->size(), chosen.size());
  EXPECT_EQ(sha256_of_folder(received.frames()).value(), sha256_of_folder(sent.frames()).value());
  EXPECT_EQ(read_file(sent.root() / "avatar.glb").value(), avatar_of(received));
}

INSTANTIATE_TEST_SUITE_P(Seeds, Fault, testing::Range(1U, 7U));

}  // namespace
}  // namespace gyre
