// SPDX-License-Identifier: Apache-2.0
// Host and device as processes of their own, killed with SIGKILL at random moments and started again.
#include "common/bundle/atomic_file.h"
#include "common/bundle/sha256.h"
#include "tests/offload/ingest/link_support.h"

#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>
#include <csignal>
#include <random>

namespace gyre {
namespace {

constexpr int frames = 40;
constexpr std::size_t frame_bytes = 400'000;
constexpr int kills = 10;

bool is_chosen(int frame) {
  return frame % 5 != 4;
}

std::vector<int> chosen_frames() {
  std::vector<int> chosen;
  for (int i = 0; i < frames; ++i) {
    if (is_chosen(i)) chosen.push_back(i);
  }
  return chosen;
}

// Receives and reconstructs until it is killed.
void be_host(TestHost& host) {
  host.start();
  while (!testing::Test::HasFailure()) {
    static_cast<void>(eventually([&] {
      host.run_jobs();
      return false;
    }));
  }
}

// Records the same scan as before the last kill and waits for its avatar.
bool be_device(TestDevice& device, const TestHost& host, const Scan& scan) {
  device.connect(host);
  Spool& spool = device.spool();
  const std::optional<SpoolPhase> phase = spool.phase(scan.id);
  if (!phase || *phase == SpoolPhase::recording) {
    if (!spool.open_scan(scan)) return false;
    for (int i = 0; i < frames; ++i) {
      const auto keyframe = small_keyframe(static_cast<std::uint64_t>(i), frame_bytes);
      if (!spool.add_file(scan.id, keyframe_name(i), keyframe)) return false;
      if (!is_chosen(i) && !spool.discard(scan.id, keyframe_name(i))) return false;
    }
    if (!spool.close_scan(scan, small_records(frames, chosen_frames()))) return false;
  }
  return device.uplink().wait_for_result(scan.id, {std::chrono::seconds(60), std::chrono::seconds(300)}).has_value();
}

template <class Work>
pid_t start_process(Work work) {
  const pid_t child = ::fork();
  if (child != 0) return child;
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  work();
  ::_exit(testing::Test::HasFailure() ? 1 : 0);
}

void kill_process(pid_t process) {
  ::kill(process, SIGKILL);
  ::waitpid(process, nullptr, 0);
}

TEST(LinkKill, TenKillsLoseAndDoubleNothing) {
  std::mt19937 random(20);
  TestHost host;
  TestDevice device("rig");
  host.authorise(device.options().keys);
  host.start();  // finds a port, which stays
  host.stop();
  const Scan scan = small_scan();
  const auto start_host = [&] { return start_process([&] { be_host(host); }); };
  const auto start_device = [&] { return start_process([&] { EXPECT_TRUE(be_device(device, host, scan)); }); };
  pid_t host_process = start_host();
  pid_t device_process = start_device();

  int status = -1;
  bool finished = false;
  for (int i = 0; i < kills && !finished; ++i) {
    const std::uint64_t goal = bytes_below(host.folder()) + random() % (frames * frame_bytes / kills);
    ASSERT_TRUE(eventually([&] {
      finished = ::waitpid(device_process, &status, WNOHANG) == device_process;
      return finished || bytes_below(host.folder()) >= goal;
    }));
    if (finished) break;
    if (random() % 2 == 0) {
      kill_process(host_process);
      host_process = start_host();
    } else {
      kill_process(device_process);
      device_process = start_device();
    }
  }
  if (!finished) {
    ASSERT_EQ(::waitpid(device_process, &status, 0), device_process);
  }
  kill_process(host_process);
  ASSERT_EQ(status, 0);

  host.start();
  device.open_spool();
  const Bundle sent = device.spool().bundle(scan.id);
  const Bundle received = host.store().bundle(scan.id);
  EXPECT_EQ(device.spool().phase(scan.id), SpoolPhase::delivered);
  EXPECT_TRUE(verify_bundle(received));
  EXPECT_EQ(list_frames(received)->size(), chosen_frames().size());
  EXPECT_EQ(sha256_of_folder(received.frames()).value(), sha256_of_folder(sent.frames()).value());
  EXPECT_EQ(read_file(sent.root() / "avatar.glb").value(), avatar_of(received));
  EXPECT_EQ(host.store().scans()->size(), 1U);
}

}  // namespace
}  // namespace gyre
