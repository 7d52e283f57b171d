// SPDX-License-Identifier: Apache-2.0
// Disks that are really full: file systems of a few MiB, in a mount namespace of this test's own.
#include "common/bundle/atomic_file.h"
#include "common/bundle/disk_space.h"
#include "tests/offload/ingest/link_support.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <unistd.h>

namespace gyre {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t picture_bytes = 1'000'000;
constexpr int pictures = 10;

// Needs root, or a kernel that lets others have name spaces. Before there are threads.
bool can_mount() {
  const uid_t user = ::getuid();
  const gid_t group = ::getgid();
  if (::unshare(user == 0 ? CLONE_NEWNS : CLONE_NEWNS | CLONE_NEWUSER) != 0) return false;
  if (user != 0) {
    std::ofstream("/proc/self/setgroups") << "deny";
    std::ofstream("/proc/self/uid_map") << "0 " << user << " 1";
    std::ofstream("/proc/self/gid_map") << "0 " << group << " 1";
  }
  return ::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0;
}

// A disk of that many MiB.
class SmallDisk {
 public:
  SmallDisk(fs::path folder, int mib) : folder_(std::move(folder)) {
    fs::create_directories(folder_);
    EXPECT_EQ(::mount("tmpfs", folder_.c_str(), "tmpfs", 0, size(mib).c_str()), 0);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  ~SmallDisk() { ::umount2(folder_.c_str(), MNT_DETACH); }

  void grow(int mib) const { EXPECT_EQ(::mount("tmpfs", folder_.c_str(), "tmpfs", MS_REMOUNT, size(mib).c_str()), 0); }

 private:
  static std::string size(int mib) { return "size=" + std::to_string(mib) + "m"; }
  fs::path folder_;
};

class FullDisk : public testing::Test {
 protected:
  void SetUp() override {
    static const bool possible = can_mount();
    if (!possible) GTEST_SKIP() << "no file system can be mounted here";
  }
};

std::vector<int> all_pictures() {
  std::vector<int> all;
  for (int i = 0; i < pictures; ++i) all.push_back(i);
  return all;
}

TEST_F(FullDisk, OfTheHostKeepsNothingFromArrivingInTheEnd) {
  const LogCapture log;
  TestHost host;
  host.set_reserve(0);
  const SmallDisk disk(host.folder() / "store", 5);
  TestDevice device("rig");
  host.authorise(device.options().keys);
  host.start();
  device.connect(host);
  const Scan scan = small_scan();
  ASSERT_TRUE(spool_scan(device.spool(), scan, all_pictures(), picture_bytes, 1));
  // Both ends say what is to be done.
  ASSERT_TRUE(eventually([&] { return log.has("No space left on device") || log.has("disk is full"); }));
  ASSERT_TRUE(eventually([&] { return device.uplink().status().text.find(full_disk_remedy) != std::string::npos; }))
      << device.uplink().status().text;
  EXPECT_TRUE(host.queued().empty());
  // Also when the host starts while it is full.
  host.stop();
  disk.grow(6);
  host.start();
  EXPECT_NE(device.spool().phase(scan.id), SpoolPhase::acknowledged);
  disk.grow(64);
  EXPECT_TRUE(eventually([&] { return device.spool().phase(scan.id) == SpoolPhase::acknowledged; }));
  EXPECT_EQ(host.queued(), std::vector{scan.id});
  EXPECT_TRUE(host.store().verify(scan.id)->empty());
  EXPECT_EQ(host.store().files(scan.id)->size(), static_cast<std::size_t>(pictures + 2));
  device.stop();
  host.stop();
}

TEST_F(FullDisk, OfTheDeviceLosesNothingItHas) {
  const TemporaryFolder folder;
  const SmallDisk disk(folder.path() / "spool", 4);
  const Scan scan = small_scan();
  std::vector<int> kept;
  {
    const auto spool = Spool::open(folder.path() / "spool", 0).value();
    ASSERT_TRUE(spool->open_scan(scan));
    for (const int i : all_pictures()) {
      const Result<void> added =
          spool->add_file(scan.id, keyframe_name(i), small_keyframe(static_cast<std::uint64_t>(i), picture_bytes));
      if (added) {
        kept.push_back(i);
      } else {
        EXPECT_NE(added.error().message().find("free some space"), std::string::npos) << added.error().message();
      }
    }
    EXPECT_GE(kept.size(), 2U);
    EXPECT_LT(kept.size(), 5U);
  }
  disk.grow(64);
  const auto spool = Spool::open(folder.path() / "spool", 0).value();
  ASSERT_EQ(spool->phase(scan.id), SpoolPhase::recording);
  ASSERT_TRUE(spool->close_scan(scan, small_records(pictures, kept)));
  for (const int i : kept) {
    const std::string content = read_file(spool->bundle(scan.id).root() / keyframe_name(i)).value_or("");
    const std::vector<std::byte> truth = small_keyframe(static_cast<std::uint64_t>(i), picture_bytes);
    EXPECT_TRUE(std::ranges::equal(std::as_bytes(std::span(content)), truth)) << i;
  }
}

TEST_F(FullDisk, IsToldByEveryWrite) {
  const TemporaryFolder folder;
  const SmallDisk disk(folder.path() / "disk", 1);
  const fs::path file = folder.path() / "disk" / "file";
  ASSERT_TRUE(write_file(file, std::string_view("before")));
  const Result<void> written = write_file(file, std::string(2 << 20, 'x'));
  ASSERT_FALSE(written);
  EXPECT_TRUE(is_full_disk(written.error())) << written.error().message();
  EXPECT_EQ(read_file(file).value(), "before");
}

}  // namespace
}  // namespace gyre
