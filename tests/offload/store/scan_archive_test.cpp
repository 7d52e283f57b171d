// SPDX-License-Identifier: Apache-2.0
#include "offload/store/scan_archive.h"

#include "common/bundle/atomic_file.h"
#include "common/bundle/sha256.h"
#include "tests/device/spool/scan_support.h"
#include "tests/fuzz/fuzz.h"

#include <archive.h>
#include <archive_entry.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace gyre {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::string finished_scan(Store& store) {
  const Scan scan = small_scan();
  EXPECT_TRUE(store.open_scan(scan, "a key", "rig"));
  const Bundle bundle = store.bundle(scan.id);
  EXPECT_TRUE(write_file(bundle.frame("body", 1), std::string_view("picture")));
  EXPECT_TRUE(store.add_file(scan.id, {"frames/body-000001.jpg", 7, sha256("picture")}));
  fs::create_directories(bundle.work("cloud"));
  fs::create_directories(bundle.root() / "work" / ".fit.part");
  EXPECT_TRUE(write_file(bundle.work("cloud") / "cloud.ply", std::string(200'000, 'c')));
  EXPECT_TRUE(write_file(bundle.root() / "work" / ".fit.part" / "half", std::string_view("half")));
  EXPECT_TRUE(write_file(bundle.root() / "avatar.glb", std::string_view("abc")));
  EXPECT_TRUE(store.queue_job(scan.id));
  EXPECT_TRUE(store.take_job().value());
  EXPECT_TRUE(store.finish_job(scan.id, {{"avatar.glb", 3, sha256("abc")}}));
  EXPECT_TRUE(store.set_delivered(scan.id));
  return scan.id;
}

TEST(ScanArchive, AScanComesBackAsItWasAlsoAfterItWasDeleted) {
  const TemporaryFolder folder;
  const auto store = Store::open(folder.path() / "store").value();
  const std::string id = finished_scan(*store);
  const fs::path tar = folder.path() / "scan.tar";
  ASSERT_TRUE(store->export_scan(id, tar));
  EXPECT_FALSE(store->import_scan(tar));  // it is there
  ASSERT_TRUE(store->delete_scan(id));
  const Result<std::string> back = store->import_scan(tar);
  ASSERT_TRUE(back) << back.error().message();
  EXPECT_EQ(*back, id);
  EXPECT_TRUE(store->verify(id)->empty());
  EXPECT_EQ(store->scan(id).value()->phase, StorePhase::done);
  EXPECT_EQ(store->scan(id).value()->device_key, "a key");
  EXPECT_TRUE(store->scan(id).value()->delivered);
  EXPECT_EQ(store->results(id)->size(), 1U);
  EXPECT_EQ(read_file(store->bundle(id).work("cloud") / "cloud.ply")->size(), 200'000U);
  EXPECT_FALSE(fs::exists(store->bundle(id).root() / "work" / ".fit.part"));
  EXPECT_FALSE(store->deleted_at(id).value());

  const auto elsewhere = Store::open(folder.path() / "elsewhere").value();
  EXPECT_EQ(elsewhere->import_scan(tar).value(), id);
}

TEST(ScanArchive, ADamagedOneChangesNothing) {
  const TemporaryFolder folder;
  const auto store = Store::open(folder.path() / "store").value();
  const std::string id = finished_scan(*store);
  const fs::path tar = folder.path() / "scan.tar";
  ASSERT_TRUE(store->export_scan(id, tar));
  ASSERT_TRUE(store->delete_scan(id));
  std::string bytes = read_file(tar).value();
  bytes[bytes.find("picture")] = 'P';
  ASSERT_TRUE(write_file(tar, bytes));
  EXPECT_NE(store->import_scan(tar).error().message().find("damaged: frames/body-000001.jpg"), std::string::npos);
  ASSERT_TRUE(write_file(tar, bytes.substr(0, bytes.size() / 2)));
  EXPECT_FALSE(store->import_scan(tar));
  EXPECT_FALSE(store->import_scan(folder.path() / "none.tar"));
  EXPECT_TRUE(store->scans()->empty());
  EXPECT_FALSE(fs::exists(store->bundle(id).root()));
  EXPECT_TRUE(fs::is_empty(folder.path() / "store" / "incoming"));
}

struct Part {
  std::string name;
  std::string content;
  unsigned type = AE_IFREG;
  std::string link = {};
};

// A tar as somebody hostile would make it: a good manifest of that scan, and then anything.
std::string hostile_tar(const fs::path& file, const std::string& id, const std::vector<Part>& parts) {
  const json manifest = {
      {"version", 1},    {"scan", id},   {"device_key", "k"}, {"device_name", "rig"},   {"created", "now"},
      {"phase", "done"}, {"reason", ""}, {"delivered", true}, {"files", json::array()}, {"results", json::array()}};
  std::vector<Part> all = {{id + "/scan.archive.json", manifest.dump()}};
  all.insert(all.end(), parts.begin(), parts.end());
  archive* a = archive_write_new();
  archive_write_set_format_pax_restricted(a);
  EXPECT_EQ(archive_write_open_filename(a, file.c_str()), ARCHIVE_OK);
  for (const Part& part : all) {
    archive_entry* entry = archive_entry_new();
    archive_entry_set_pathname(entry, part.name.c_str());
    archive_entry_set_filetype(entry, part.type);
    archive_entry_set_perm(entry, 0644);
    archive_entry_set_size(entry, static_cast<la_int64_t>(part.content.size()));
    if (part.type == AE_IFLNK) archive_entry_set_symlink(entry, part.link.c_str());
    if (part.type == AE_IFREG && !part.link.empty()) archive_entry_set_hardlink(entry, part.link.c_str());
    archive_write_header(a, entry);
    archive_write_data(a, part.content.data(), part.content.size());
    archive_entry_free(entry);
  }
  archive_write_free(a);
  return read_file(file).value();
}

TEST(ScanArchive, HostileOnesAreRefused) {
  const TemporaryFolder folder;
  const fs::path tar = folder.path() / "scan.tar";
  const std::string id = small_scan().id;
  const std::string in = id + "/bundle/";
  const std::vector<std::vector<Part>> tricks = {
      {{in + "../../outside", "x"}},
      {{"/etc/outside", "x"}},
      {{in + "/etc/outside", "x"}},
      {{in + "frames/../../../outside", "x"}},
      {{in + ".hidden", "x"}},
      {{in, "x"}},
      {{"other/bundle/a", "x"}},
      {{in + "link", "", AE_IFLNK, "/etc"}},
      {{in + "link", "", AE_IFLNK, ".."}, {in + "link/outside", "x"}},
      {{in + "a", "x"}, {in + "b", "", AE_IFREG, "/etc/passwd"}},
      {{in + "pipe", "", AE_IFIFO}},
      {{in + "folder", "", AE_IFDIR}},
      {{in + "a", "x"}, {in + "a", "y"}},
      {{in + "a", "x"}, {in + "a/b", "y"}},
      {{in + "1/2/3/4/5/6/7/8/9", "x"}},
      {{in + std::string(300, 'n'), "x"}},
  };
  for (const std::vector<Part>& parts : tricks) {
    SCOPED_TRACE(parts.back().name);
    hostile_tar(tar, id, parts);
    const fs::path into = folder.path() / "a" / "b" / "into";
    fs::remove_all(folder.path() / "a");
    fs::create_directories(into);
    EXPECT_FALSE(unpack_scan(tar, into));
    // Nothing but what lies in the folder it was given.
    EXPECT_EQ(std::distance(fs::directory_iterator(folder.path() / "a"), {}), 1);
    EXPECT_EQ(std::distance(fs::directory_iterator(folder.path() / "a" / "b"), {}), 1);
    EXPECT_FALSE(fs::exists("/etc/outside"));
    for (const auto& entry : fs::recursive_directory_iterator(into)) {
      EXPECT_FALSE(entry.is_symlink());
    }
  }
  hostile_tar(tar, id, {{in + "a", std::string(2000, 'x')}, {in + "b", std::string(2000, 'x')}});
  const fs::path into = folder.path() / "into";
  fs::create_directories(into);
  EXPECT_TRUE(unpack_scan(tar, into, {4000, 2}));
  for (const ArchiveLimits& limits : {ArchiveLimits{3999, 2}, ArchiveLimits{4000, 1}}) {
    fs::remove_all(into);
    fs::create_directories(into);
    EXPECT_FALSE(unpack_scan(tar, into, limits));
  }
}

TEST(ScanArchive, MutatedOnesNeverCrashOrEscape) {
  const TemporaryFolder folder;
  const std::string id = small_scan().id;
  const std::string good = hostile_tar(folder.path() / "scan.tar", id,
                                       {{id + "/bundle/scan.json", "{}"}, {id + "/bundle/frames/a", "picture"}});
  fuzz({good, good.substr(0, 700), hostile_tar(folder.path() / "scan.tar", id, {{id + "/bundle/../x", "y"}})}, 2000);
}

TEST(Retention, LetsGoOnlyWhatIsDelivered) {
  const TemporaryFolder folder;
  const auto store = Store::open(folder.path() / "store").value();
  const WallTime now = wall_time_now();
  using std::chrono::hours;
  std::vector<std::string> ids;
  for (int i = 0; i < 3; ++i) {
    ids.push_back(finished_scan(*store));
    ASSERT_TRUE(store->set_delivered(ids.back(), now - hours(10 * (3 - i))));
  }
  const Scan fresh = small_scan();
  ASSERT_TRUE(store->open_scan(fresh, "a key", "rig"));
  using Ids = std::vector<std::string>;
  EXPECT_EQ(store->expired({}, now + hours(10'000)).value(), Ids());
  EXPECT_EQ(store->expired({hours(15), {}}, now).value(), (Ids{ids[0], ids[1]}));
  EXPECT_EQ(store->expired({{}, 2}, now).value(), (Ids{ids[0]}));
  EXPECT_EQ(store->expired({hours(25), 1}, now).value(), (Ids{ids[0], ids[1]}));
  ASSERT_TRUE(store->retry_job(ids[0]));  // is worked on again
  EXPECT_EQ(store->expired({hours(15), {}}, now).value(), Ids{ids[1]});
}

}  // namespace
}  // namespace gyre
