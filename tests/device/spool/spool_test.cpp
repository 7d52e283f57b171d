// SPDX-License-Identifier: Apache-2.0
#include "device/spool/spool.h"

#include "common/bundle/atomic_file.h"
#include "common/bundle/sha256.h"
#include "tests/device/spool/scan_support.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <csignal>
#include <random>

namespace gyre {
namespace {

namespace fs = std::filesystem;

std::unique_ptr<Spool> open_spool(const fs::path& folder) {
  Result<std::unique_ptr<Spool>> spool = Spool::open(folder);
  EXPECT_TRUE(spool) << spool.error().message();
  return std::move(spool).value();
}

TEST(Spool, KeepsAScanThroughAllItsPhases) {
  const TemporaryFolder folder;
  const Scan scan = small_scan();
  auto spool = open_spool(folder.path());
  ASSERT_TRUE(spool_scan(*spool, scan, {3, 7}, 1000, 1));
  EXPECT_EQ(spool->phase(scan.id), SpoolPhase::closed);
  EXPECT_TRUE(verify_bundle(spool->bundle(scan.id)));
  EXPECT_FALSE(spool->remove_scan(scan.id));  // the host has nothing yet

  spool.reset();
  spool = open_spool(folder.path());
  const std::optional<SpooledScan> closed = spool->scan(scan.id);
  ASSERT_TRUE(closed);
  ASSERT_EQ(closed->files.size(), 4U);  // two keyframes, frames.jsonl, scan.json
  for (const SpooledFile& file : closed->files) {
    EXPECT_EQ(sha256_of_file(spool->bundle(scan.id).root() / file.name).value(), file.sha256);
    ASSERT_TRUE(spool->acknowledge_file(scan.id, file.name, file.sha256));
  }
  ASSERT_TRUE(spool->acknowledge_scan(scan.id));

  spool.reset();
  spool = open_spool(folder.path());
  EXPECT_EQ(spool->phase(scan.id), SpoolPhase::acknowledged);
  const fs::path part = spool->bundle(scan.id).root() / "avatar.glb.part";
  ASSERT_TRUE(write_file(part, std::string_view("avatar")));
  ASSERT_TRUE(spool->add_result(scan.id, {"avatar.glb", 6, sha256("avatar"), SpooledFilePhase::acknowledged}, part));
  ASSERT_TRUE(spool->deliver_scan(scan.id));

  spool.reset();
  spool = open_spool(folder.path());
  EXPECT_EQ(spool->phase(scan.id), SpoolPhase::delivered);
  EXPECT_EQ(read_file(spool->bundle(scan.id).root() / "avatar.glb").value(), "avatar");
  ASSERT_TRUE(spool->remove_scan(scan.id));
  EXPECT_TRUE(spool->scan_ids().empty());
  EXPECT_FALSE(fs::exists(folder.path() / scan.id));
}

TEST(Spool, GoesOnRecordingAfterARestart) {
  const TemporaryFolder folder;
  const Scan scan = small_scan();
  const auto bytes = small_keyframe(1, 500);
  auto spool = open_spool(folder.path());
  ASSERT_TRUE(spool->open_scan(scan));
  ASSERT_TRUE(spool->add_file(scan.id, keyframe_name(1), bytes));
  ASSERT_TRUE(spool->add_file(scan.id, keyframe_name(2), bytes));
  ASSERT_TRUE(spool->discard(scan.id, keyframe_name(2)));
  const SpooledFile before = spool->scan(scan.id)->files[0];
  ASSERT_TRUE(spool->acknowledge_file(scan.id, before.name, before.sha256));

  spool.reset();
  spool = open_spool(folder.path());
  EXPECT_EQ(spool->phase(scan.id), SpoolPhase::recording);
  ASSERT_TRUE(spool->open_scan(scan));
  ASSERT_TRUE(spool->add_file(scan.id, keyframe_name(1), bytes));  // the same again changes nothing
  EXPECT_EQ(spool->scan(scan.id)->files[0].phase, SpooledFilePhase::acknowledged);
  EXPECT_EQ(spool->scan(scan.id)->files[1].phase, SpooledFilePhase::discarded);
  EXPECT_FALSE(fs::exists(spool->bundle(scan.id).frame("body", 2)));
  ASSERT_TRUE(spool->add_file(scan.id, keyframe_name(1), small_keyframe(2, 500)));  // other content has to go again
  EXPECT_EQ(spool->scan(scan.id)->files[0].phase, SpooledFilePhase::spooled);
  ASSERT_TRUE(spool->add_file(scan.id, keyframe_name(2), bytes));  // the selection changed its mind
  ASSERT_TRUE(spool->close_scan(scan, small_records(3, {1, 2})));
  EXPECT_TRUE(verify_bundle(spool->bundle(scan.id)));
}

TEST(Spool, RemovesWhatNoCallPromised) {
  const TemporaryFolder folder;
  const Scan scan = small_scan();
  auto spool = open_spool(folder.path());
  ASSERT_TRUE(spool->open_scan(scan));
  ASSERT_TRUE(spool->add_file(scan.id, keyframe_name(1), small_keyframe(1, 500)));
  ASSERT_TRUE(spool->add_file(scan.id, keyframe_name(2), small_keyframe(2, 500)));
  const Bundle bundle = spool->bundle(scan.id);
  spool.reset();
  // As if killed: between a picture and its journal line, within a write, and while replacing a picture.
  ASSERT_TRUE(write_file(bundle.frame("body", 9), small_keyframe(9, 500)));
  ASSERT_TRUE(write_file(bundle.frames() / "body-000008.jpg.part77-78", std::string_view("half")));
  const auto replaced = small_keyframe(22, 600);
  ASSERT_TRUE(write_file(bundle.frame("body", 2), replaced));

  spool = open_spool(folder.path());
  const SpooledScan now = *spool->scan(scan.id);
  ASSERT_EQ(now.files.size(), 2U);
  EXPECT_EQ(now.files[1].sha256, sha256(replaced));
  EXPECT_EQ(now.files[1].size, replaced.size());
  EXPECT_EQ(std::distance(fs::directory_iterator(bundle.frames()), fs::directory_iterator()), 2);
}

TEST(Spool, RefusesASelectionThatIsNotWhatItHolds) {
  const TemporaryFolder folder;
  const Scan scan = small_scan();
  auto spool = open_spool(folder.path());
  ASSERT_TRUE(spool->open_scan(scan));
  ASSERT_TRUE(spool->add_file(scan.id, keyframe_name(1), small_keyframe(1, 500)));
  EXPECT_FALSE(spool->close_scan(scan, small_records(3, {})));
  EXPECT_FALSE(spool->close_scan(scan, small_records(3, {1, 2})));
  EXPECT_EQ(spool->phase(scan.id), SpoolPhase::recording);
  EXPECT_FALSE(spool->add_file(scan.id, "frames/../../x", small_keyframe(1, 500)));
  EXPECT_FALSE(spool->add_file(scan.id, "avatar.glb", small_keyframe(1, 500)));
  ASSERT_TRUE(spool->close_scan(scan, small_records(3, {1})));
  EXPECT_FALSE(spool->add_file(scan.id, keyframe_name(2), small_keyframe(2, 500)));
}

TEST(Spool, OneDamagedScanLeavesTheOthersAlone) {
  const TemporaryFolder folder;
  const Scan good = small_scan();
  const Scan bad = small_scan();
  auto spool = open_spool(folder.path());
  ASSERT_TRUE(spool_scan(*spool, good, {1}, 500, 1));
  ASSERT_TRUE(spool_scan(*spool, bad, {1}, 500, 1));
  spool.reset();
  const fs::path journal = folder.path() / bad.id / "spool.jsonl";
  ASSERT_TRUE(write_file(journal, "garbage\n" + read_file(journal).value()));
  spool = open_spool(folder.path());
  EXPECT_EQ(spool->scan_ids(), std::vector<std::string>{good.id});
  EXPECT_TRUE(fs::exists(folder.path() / bad.id / "frames" / frame_name("body", 1)));
}

TEST(Spool, OneProcessAtATime) {
  const TemporaryFolder folder;
  const auto spool = open_spool(folder.path());
  const pid_t child = ::fork();
  if (child == 0) ::_exit(Spool::open(folder.path()) ? 1 : 0);
  int status = -1;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
}

// A file size limit makes write(2) fail half way, as a full disk does.
TEST(Spool, AFullDiskIsAnErrorAndTheScanIsKept) {
  const TemporaryFolder folder;
  const Scan scan = small_scan();
  open_spool(folder.path()).reset();
  const pid_t child = ::fork();
  if (child == 0) {
    std::signal(SIGXFSZ, SIG_IGN);
    auto spool = Spool::open(folder.path()).value();
    bool good =
        spool->open_scan(scan) && spool->add_file(scan.id, keyframe_name(1), small_keyframe(1, 500)).has_value();
    // Even the journal does not fit any more.
    const rlimit limit{100, 100};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    good = good && !spool->add_file(scan.id, keyframe_name(2), small_keyframe(2, 5000));
    good = good && !spool->discard(scan.id, keyframe_name(1));
    good = good && spool->scan(scan.id)->files.size() == 1 && spool->phase(scan.id) == SpoolPhase::recording;
    ::_exit(good ? 0 : 1);
  }
  int status = -1;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  const auto spool = open_spool(folder.path());
  ASSERT_EQ(spool->scan(scan.id)->files.size(), 1U);
  EXPECT_EQ(spool->scan(scan.id)->files[0].phase, SpooledFilePhase::spooled);
  EXPECT_TRUE(fs::exists(spool->bundle(scan.id).frame("body", 1)));
  ASSERT_TRUE(spool->close_scan(scan, small_records(2, {1})));
}

// Killed at random moments while recording, and started again each time: everything reported is there, nothing else.
TEST(Spool, SurvivesKillsWhileRecording) {
  const TemporaryFolder folder;
  const Scan scan = small_scan();
  constexpr int frames = 12;
  std::mt19937 random(1);
  bool finished = false;
  for (int attempt = 0; !finished; ++attempt) {
    int report[2] = {-1, -1};
    ASSERT_EQ(::pipe(report), 0);
    const pid_t child = ::fork();
    if (child == 0) {
      auto spool = Spool::open(folder.path()).value();
      bool good = spool->open_scan(scan).has_value();
      for (char i = 0; good && i < frames; ++i) {
        good =
            spool->add_file(scan.id, keyframe_name(i), small_keyframe(static_cast<std::uint64_t>(i), 3000)).has_value();
        if (i % 3 == 2) good = good && spool->discard(scan.id, keyframe_name(i)).has_value();
        good = good && ::write(report[1], &i, 1) == 1;
      }
      ::_exit(good ? 0 : 1);
    }
    ::close(report[1]);
    // Lets it report some frames, more every time, then kills it somewhere in the next.
    const int most = attempt + static_cast<int>(random() % 3);
    int reported = -1;
    char index = 0;
    while (reported < most && ::read(report[0], &index, 1) == 1) reported = index;
    if (reported < frames - 1) ::kill(child, SIGKILL);
    ::close(report[0]);
    int status = -1;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    finished = WIFEXITED(status) && WEXITSTATUS(status) == 0 && reported == frames - 1;

    const auto spool = open_spool(folder.path());
    const std::optional<SpooledScan> kept = spool->scan(scan.id);
    ASSERT_TRUE(kept);
    for (int i = 0; i <= reported; ++i) {
      const SpooledFile* file = find_file(kept->files, keyframe_name(i));
      ASSERT_NE(file, nullptr);
      EXPECT_EQ(fs::exists(spool->bundle(scan.id).frame("body", i)), file->phase != SpooledFilePhase::discarded);
      EXPECT_EQ(file->phase == SpooledFilePhase::discarded, i % 3 == 2);
    }
  }
  const auto spool = open_spool(folder.path());
  ASSERT_TRUE(spool->close_scan(scan, small_records(frames, {0, 1, 3, 4, 6, 7, 9, 10})));
  EXPECT_TRUE(verify_bundle(spool->bundle(scan.id)));
}

// On a real, small disk of its own: a file system in memory that only this process's child sees.
TEST(SpoolRoom, ScansWhoseResultsAreHereMakeRoomAndOthersNever) {
  constexpr int not_allowed = 77;
  const TemporaryFolder folder;
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const bool own_mounts = ::unshare(CLONE_NEWNS) == 0 || ::unshare(CLONE_NEWUSER | CLONE_NEWNS) == 0;
    if (!own_mounts || ::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
        ::mount("tmpfs", folder.path().c_str(), "tmpfs", 0, "size=8m") != 0) {
      ::_exit(not_allowed);
    }
    constexpr std::size_t mib = 1 << 20;
    const auto spool = Spool::open(folder.path(), mib).value();
    const auto scan_with = [&](std::size_t bytes, std::uint64_t seed) {
      const Scan scan = small_scan();
      return spool_scan(*spool, scan, {1}, bytes, seed) ? scan.id : std::string();
    };
    const std::string delivered = scan_with(2 * mib, 1);
    const std::string acknowledged = scan_with(2 * mib, 2);
    if (!spool->acknowledge_scan(delivered) || !spool->deliver_scan(delivered)) ::_exit(1);
    if (!spool->acknowledge_scan(acknowledged)) ::_exit(2);
    // About 4 MiB are left, 1 of them kept free.
    const Scan scan = small_scan();
    if (!spool->open_scan(scan)) ::_exit(3);
    std::vector<int> chosen;
    const auto add = [&](int index) {
      const auto picture = small_keyframe(static_cast<std::uint64_t>(index), mib);
      const bool added = spool->add_file(scan.id, keyframe_name(index), picture).has_value();
      if (added) chosen.push_back(index);
      return added;
    };
    if (!add(1) || !add(2) || !spool->scan(delivered)) ::_exit(4);  // there was room enough
    if (!add(3) || spool->scan(delivered) || fs::exists(folder.path() / delivered)) ::_exit(5);
    int index = 4;
    while (add(index)) ++index;
    if (index != 5 || !spool->scan(acknowledged)) ::_exit(6);
    const Result<void> refused = spool->add_file(scan.id, keyframe_name(9), small_keyframe(9, mib));
    if (refused || refused.error().message().find("nearly full") == std::string::npos) ::_exit(7);
    if (!spool->close_scan(scan, small_records(6, chosen))) ::_exit(8);
    if (!verify_bundle(spool->bundle(scan.id)) || !verify_bundle(spool->bundle(acknowledged))) ::_exit(9);
    ::_exit(0);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  if (WEXITSTATUS(status) == not_allowed) GTEST_SKIP() << "this machine allows no mounts of one's own";
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace gyre
