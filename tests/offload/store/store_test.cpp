// SPDX-License-Identifier: Apache-2.0
#include "offload/store/store.h"

#include "common/bundle/atomic_file.h"
#include "common/bundle/sha256.h"
#include "tests/device/spool/scan_support.h"

#include <gtest/gtest.h>
#include <sqlite3.h>
#include <thread>

namespace gyre {
namespace {

namespace fs = std::filesystem;

const std::string key = "a key of forty characters, more or less.";
const std::string hash(64, 'a');

std::unique_ptr<Store> open_store(const fs::path& folder) {
  Result<std::unique_ptr<Store>> store = Store::open(folder);
  EXPECT_TRUE(store) << store.error().message();
  return std::move(store).value();
}

StorePhase phase(const Store& store, const std::string& id) {
  return store.scan(id).value()->phase;
}

std::optional<std::string> taken(Store& store) {
  const std::optional<StoredJob> job = store.take_job().value();
  return job ? std::optional(job->scan) : std::nullopt;
}

void execute(const fs::path& file, const char* sql) {
  sqlite3* connection = nullptr;
  ASSERT_EQ(sqlite3_open(file.c_str(), &connection), SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(connection, sql, nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(connection);
  sqlite3_close(connection);
}

TEST(Store, KeepsAScanThroughAllItsPhases) {
  const TemporaryFolder folder;
  auto store = open_store(folder.path());
  const Scan scan = small_scan();
  ASSERT_TRUE(store->open_scan(scan, key, "rig"));
  ASSERT_TRUE(store->open_scan(scan, key, "rig"));
  EXPECT_TRUE(fs::exists(store->bundle(scan.id).scan_file()));
  EXPECT_EQ(phase(*store, scan.id), StorePhase::receiving);
  ASSERT_TRUE(store->add_file(scan.id, {"frames/body-000001.jpg", 5, hash}));
  ASSERT_TRUE(store->add_file(scan.id, {"frames/body-000001.jpg", 6, hash}));
  ASSERT_TRUE(store->add_file(scan.id, {"scan.json", 7, hash}));
  ASSERT_TRUE(store->remove_file(scan.id, "scan.json"));

  store.reset();
  store = open_store(folder.path());
  ASSERT_EQ(store->files(scan.id)->size(), 1U);
  EXPECT_EQ(store->file(scan.id, "frames/body-000001.jpg").value()->size, 6U);
  EXPECT_FALSE(store->file(scan.id, "scan.json").value());
  EXPECT_FALSE(store->take_job().value());
  ASSERT_TRUE(store->queue_job(scan.id));
  EXPECT_EQ(phase(*store, scan.id), StorePhase::queued);
  EXPECT_EQ(taken(*store), scan.id);
  EXPECT_EQ(phase(*store, scan.id), StorePhase::running);
  EXPECT_FALSE(store->take_job().value());

  store.reset();
  store = open_store(folder.path());  // the host went down while the job ran
  EXPECT_EQ(phase(*store, scan.id), StorePhase::queued);
  EXPECT_EQ(taken(*store), scan.id);
  ASSERT_TRUE(store->finish_job(scan.id, {{"avatar.glb", 3, hash}, {"report.json", 4, hash}}));
  EXPECT_EQ(phase(*store, scan.id), StorePhase::done);
  EXPECT_EQ(store->results(scan.id)->at(1).name, "report.json");
  ASSERT_TRUE(store->set_delivered(scan.id));
  ASSERT_TRUE(store->queue_job(scan.id));  // has a job already

  store.reset();
  store = open_store(folder.path());
  EXPECT_EQ(phase(*store, scan.id), StorePhase::done);
  EXPECT_TRUE(store->scan(scan.id).value()->delivered);
  EXPECT_EQ(store->results(scan.id)->size(), 2U);
}

// Brings a new scan to a phase.
std::string scan_in(Store& store, StorePhase phase) {
  const Scan scan = small_scan();
  EXPECT_TRUE(store.open_scan(scan, key, "rig"));
  if (phase == StorePhase::receiving) return scan.id;
  EXPECT_TRUE(store.queue_job(scan.id));
  if (phase == StorePhase::queued) return scan.id;
  EXPECT_EQ(taken(store), scan.id);
  if (phase == StorePhase::done) {
    EXPECT_TRUE(store.finish_job(scan.id, {{"avatar.glb", 3, hash}}));
  } else if (phase == StorePhase::failed) {
    EXPECT_TRUE(store.fail_job(scan.id, "reason"));
  }
  return scan.id;
}

// Every event in every phase does to the store what the table says, and nothing where the table says nothing.
TEST(Store, WalksItsTableAndNothingElse) {
  constexpr int phases = static_cast<int>(StorePhase::failed) + 1;
  constexpr int events = static_cast<int>(ScanEvent::delivered) + 1;
  std::size_t walked = 0;
  for (int p = 0; p < phases; ++p) {
    for (int e = 0; e < events; ++e) {
      const auto from = static_cast<StorePhase>(p);
      const auto event = static_cast<ScanEvent>(e);
      SCOPED_TRACE(std::string(name_of(from)) + " + " + std::string(name_of(event)));
      const TemporaryFolder folder;
      auto store = open_store(folder.path());
      const std::string id = scan_in(*store, from);
      ASSERT_EQ(phase(*store, id), from);
      const std::optional<StorePhase> next = next_phase(from, event);
      bool done = false;
      switch (event) {
        case ScanEvent::completed:
          done = store->queue_job(id).has_value();
          break;
        case ScanEvent::unusable:
        case ScanEvent::failed:
          done = store->fail_job(id, "why").has_value();
          break;
        case ScanEvent::taken:
          done = taken(*store) == id;
          break;
        case ScanEvent::interrupted:
          store.reset();
          store = open_store(folder.path());
          done = phase(*store, id) != from;
          break;
        case ScanEvent::finished:
          done = store->finish_job(id, {{"avatar.glb", 3, hash}}).has_value();
          break;
        case ScanEvent::retried:
          done = store->retry_job(id).has_value();
          break;
        case ScanEvent::delivered:
          done = store->set_delivered(id).has_value();
          break;
      }
      // Both mean that the scan failed; which one it is depends on whether it has a job.
      const bool either = event == ScanEvent::unusable || event == ScanEvent::failed;
      const std::optional<StorePhase> other =
          either ? next_phase(from, event == ScanEvent::failed ? ScanEvent::unusable : ScanEvent::failed) : next;
      EXPECT_EQ(done, next.has_value() || other.has_value());
      EXPECT_EQ(phase(*store, id), next ? *next : other.value_or(from));
      if (next) ++walked;
    }
  }
  EXPECT_EQ(walked, scan_transitions().size());
}

TEST(Store, AJobThatIsRetriedKeepsItsResultsUntilItHasOthers) {
  const TemporaryFolder folder;
  const auto store = open_store(folder.path());
  const std::string id = scan_in(*store, StorePhase::done);
  ASSERT_TRUE(store->set_delivered(id));
  ASSERT_TRUE(store->retry_job(id));
  EXPECT_EQ(store->results(id)->size(), 1U);
  EXPECT_EQ(taken(*store), id);
  ASSERT_TRUE(store->finish_job(id, {{"avatar.glb", 4, hash}}));
  EXPECT_EQ(store->results(id)->at(0).size, 4U);
  EXPECT_FALSE(store->scan(id).value()->delivered);  // the device has not seen these
}

TEST(Store, AJobThatIsPutBackWaitsUntilItIsDue) {
  const TemporaryFolder folder;
  const auto store = open_store(folder.path());
  const std::string id = scan_in(*store, StorePhase::running);
  const WallTime now = wall_time_now();
  using std::chrono::seconds;
  ASSERT_TRUE(store->put_back_job(id, "crashed", now + seconds(10)));
  EXPECT_EQ(store->jobs()->at(0).reason, "crashed");
  EXPECT_FALSE(store->take_job(now + seconds(9)).value());
  EXPECT_EQ(store->take_job(now + seconds(10)).value()->tries, 2);
  ASSERT_TRUE(store->put_back_job(id, "crashed", now + seconds(10)));
  EXPECT_TRUE(store->take_job(now - std::chrono::hours(1)).value());  // the clock was set back
}

TEST(Store, AJobWhoseRunnerFallsSilentIsTakenBack) {
  const TemporaryFolder folder;
  const auto store = open_store(folder.path());
  const std::string id = scan_in(*store, StorePhase::queued);
  const WallTime now = wall_time_now();
  using std::chrono::seconds;
  const StoredJob job = *store->take_job(now, seconds(10)).value();
  EXPECT_TRUE(store->take_back_lapsed(now + seconds(10))->empty());
  EXPECT_TRUE(store->renew_lease(id, job.lease, now + seconds(20)).value());
  EXPECT_TRUE(store->take_back_lapsed(now + seconds(20))->empty());
  EXPECT_EQ(store->take_back_lapsed(now + seconds(21)).value(), std::vector{id});
  EXPECT_FALSE(store->renew_lease(id, job.lease, now + seconds(40)).value());
  const StoredJob again = *store->take_job(now, seconds(10)).value();
  EXPECT_FALSE(store->renew_lease(id, job.lease, now + seconds(40)).value());  // another holds it now
  EXPECT_TRUE(store->renew_lease(id, again.lease, now + seconds(40)).value());
}

TEST(Store, ADeviceWithManyScansDoesNotKeepAnotherWaiting) {
  const TemporaryFolder folder;
  const auto store = open_store(folder.path());
  std::vector<std::string> ids;
  for (const char* device : {"many", "many", "many", "few"}) {
    const Scan scan = small_scan();
    ids.push_back(scan.id);
    ASSERT_TRUE(store->open_scan(scan, device, "rig"));
    ASSERT_TRUE(store->queue_job(scan.id));
  }
  static_cast<void>(taken(*store));
  EXPECT_EQ(taken(*store), ids[3]);
}

TEST(Store, AJobKeepsTheOptionsItIsRunAgainWith) {
  const TemporaryFolder folder;
  auto store = open_store(folder.path());
  const std::string id = scan_in(*store, StorePhase::failed);
  ASSERT_TRUE(store->retry_job(id, R"({"cloud":{"voxel_mm":3}})"));
  store.reset();
  store = open_store(folder.path());
  const StoredJob job = *store->take_job().value();
  EXPECT_EQ(job.options, R"({"cloud":{"voxel_mm":3}})");
  EXPECT_EQ(job.tries, 1);
  // Run again with other changes: the earlier ones hold until they are taken back.
  ASSERT_TRUE(store->finish_job(id, {}));
  ASSERT_TRUE(store->retry_job(id, R"({"texture":{"size":1024}})"));
  EXPECT_EQ(store->jobs()->front().options, R"({"cloud":{"voxel_mm":3},"texture":{"size":1024}})");
  ASSERT_TRUE(store->finish_job(store->take_job().value()->scan, {}));
  ASSERT_TRUE(store->retry_job(id, R"({"cloud":{"voxel_mm":null}})"));
  EXPECT_EQ(store->jobs()->front().options, R"({"cloud":{},"texture":{"size":1024}})");
}

TEST(Store, AFailedJobKeepsItsReason) {
  const TemporaryFolder folder;
  const auto store = open_store(folder.path());
  const Scan scan = small_scan();
  ASSERT_TRUE(store->open_scan(scan, key, "rig"));
  ASSERT_TRUE(store->fail_job(scan.id, "no features"));
  EXPECT_EQ(phase(*store, scan.id), StorePhase::failed);
  EXPECT_EQ(store->scan(scan.id).value()->reason, "no features");
}

TEST(Store, AScanBelongsToItsDevice) {
  const TemporaryFolder folder;
  const auto store = open_store(folder.path());
  const Scan scan = small_scan();
  ASSERT_TRUE(store->open_scan(scan, key, "rig"));
  EXPECT_FALSE(store->open_scan(scan, "another key", "rig"));
  EXPECT_EQ(store->scan(scan.id).value()->device_key, key);
  Scan trick = scan;
  trick.id = "../../elsewhere";
  EXPECT_FALSE(store->open_scan(trick, key, "rig"));
  EXPECT_FALSE(store->add_file("no such scan", {"scan.json", 1, hash}));  // the foreign key holds
}

TEST(Store, JobsAreTakenOldestFirstAndByOneTakerEach) {
  const TemporaryFolder folder;
  const auto store = open_store(folder.path());
  std::vector<std::string> ids;
  for (int i = 0; i < 8; ++i) {
    const Scan scan = small_scan();
    ids.push_back(scan.id);
    ASSERT_TRUE(store->open_scan(scan, key, "rig"));
    ASSERT_TRUE(store->queue_job(scan.id));
  }
  std::sort(ids.begin(), ids.end());
  EXPECT_EQ(taken(*store), ids.front());
  std::vector<std::string> shares[2];
  {
    std::vector<std::thread> takers;
    for (auto& mine : shares) {
      takers.emplace_back([&store, &mine] {
        while (const std::optional<std::string> id = taken(*store)) mine.push_back(*id);
      });
    }
    for (std::thread& taker : takers) taker.join();
  }
  std::vector<std::string> all = {ids.front()};
  for (const auto& mine : shares) all.insert(all.end(), mine.begin(), mine.end());
  std::sort(all.begin(), all.end());
  EXPECT_EQ(all, ids);
}

// A scan with one keyframe, something derived from it and something half received.
std::string scan_on_disk(Store& store, StorePhase phase) {
  const std::string id = scan_in(store, phase);
  const fs::path root = store.bundle(id).root();
  fs::create_directories(root / "work" / "cloud");
  EXPECT_TRUE(write_file(root / "frames" / "body-000001.jpg", std::string_view("picture")));
  EXPECT_TRUE(store.add_file(id, {"frames/body-000001.jpg", 7, sha256("picture")}));
  EXPECT_TRUE(write_file(root / "work" / "cloud" / "cloud.ply", std::string_view("cloud")));
  EXPECT_TRUE(write_file(root / "avatar.glb", std::string_view("abc")));
  EXPECT_TRUE(write_file(store.incoming(id) / "body-000002.jpg.part", std::string_view("half")));
  return id;
}

TEST(Store, SaysWhichFilesAreNotAsTheyWere) {
  const TemporaryFolder folder;
  const auto store = open_store(folder.path());
  const std::string id = scan_on_disk(*store, StorePhase::running);
  ASSERT_TRUE(store->finish_job(id, {{"avatar.glb", 3, sha256("abc")}}));
  EXPECT_TRUE(store->verify(id)->empty());
  ASSERT_TRUE(write_file(store->bundle(id).root() / "avatar.glb", std::string_view("abd")));
  ASSERT_TRUE(write_file(store->bundle(id).frame("body", 1), std::string_view("pictur")));
  const std::vector<std::string> faults = store->verify(id).value();
  ASSERT_EQ(faults.size(), 2U);
  EXPECT_NE(faults[0].find("6 bytes instead of 7"), std::string::npos);
  EXPECT_NE(faults[1].find("avatar.glb differs"), std::string::npos);
  fs::remove(store->bundle(id).frame("body", 1));
  EXPECT_NE(store->verify(id)->at(0).find("missing"), std::string::npos);
}

TEST(Store, DeletesEverythingOfAScanAndSaysWhat) {
  const TemporaryFolder folder;
  auto store = open_store(folder.path());
  const std::string other = scan_on_disk(*store, StorePhase::failed);
  const std::string id = scan_on_disk(*store, StorePhase::done);
  const Result<DeletionReceipt> receipt = store->delete_scan(id);
  ASSERT_TRUE(receipt) << receipt.error().message();
  std::set<std::string> names;
  for (const StoredFile& file : receipt->files) names.insert(file.name);
  EXPECT_EQ(names, (std::set<std::string>{"scans/" + id + "/scan.json", "scans/" + id + "/frames/body-000001.jpg",
                                          (fs::path("scans") / id / "work" / "cloud" / "cloud.ply").string(),
                                          "scans/" + id + "/avatar.glb", "incoming/" + id + "/body-000002.jpg.part"}));
  EXPECT_FALSE(store->scan(id).value());
  EXPECT_TRUE(store->files(id)->empty());
  EXPECT_TRUE(store->results(id)->empty());
  EXPECT_EQ(store->deleted_at(id).value(), receipt->at);
  EXPECT_FALSE(store->delete_scan(id));
  EXPECT_TRUE(store->verify(other)->empty());
  // Nothing of it is left below the store but its id, once, in the list of the deleted.
  for (const auto& entry : fs::recursive_directory_iterator(folder.path())) {
    EXPECT_EQ(entry.path().string().find(id), std::string::npos) << entry.path();
  }
  EXPECT_EQ(fs::file_size(folder.path() / "catalogue.sqlite-wal"), 0U);
  const std::string catalogue = read_file(folder.path() / "catalogue.sqlite").value();
  EXPECT_EQ(catalogue.find("avatar.glb"), std::string::npos);  // another scan's results have never been noted

  Scan again = small_scan();
  again.id = id;
  EXPECT_FALSE(store->open_scan(again, key, "rig"));
}

TEST(Store, ADeletionThatACrashCutShortIsFinished) {
  const TemporaryFolder folder;
  auto store = open_store(folder.path());
  const std::string id = scan_on_disk(*store, StorePhase::done);
  store.reset();
  execute(folder.path() / "catalogue.sqlite",
          ("INSERT INTO deleted (scan, at) VALUES ('" + id + "', 'now'); DELETE FROM scans WHERE id = '" + id + "'")
              .c_str());
  store = open_store(folder.path());
  EXPECT_FALSE(fs::exists(store->bundle(id).root()));
  EXPECT_FALSE(fs::exists(store->incoming(id)));
}

TEST(Store, AScanThatIsWorkedOnIsNotDeleted) {
  const TemporaryFolder folder;
  const auto store = open_store(folder.path());
  const std::string id = scan_on_disk(*store, StorePhase::running);
  EXPECT_FALSE(store->delete_scan(id));
  EXPECT_TRUE(fs::exists(store->bundle(id).frame("body", 1)));
}

TEST(Store, BringsACatalogueOfTheFirstVersionUpToDate) {
  const TemporaryFolder folder;
  auto store = open_store(folder.path());
  const std::string id = scan_in(*store, StorePhase::done);
  store.reset();
  execute(
      folder.path() / "catalogue.sqlite",
      "DROP TABLE deleted; PRAGMA user_version = 1; ALTER TABLE scans DROP COLUMN delivered_at; ALTER TABLE jobs DROP "
      "COLUMN options; ALTER TABLE jobs DROP COLUMN tries; ALTER TABLE jobs DROP COLUMN not_before; ALTER TABLE jobs "
      "DROP COLUMN lease; ALTER TABLE jobs DROP COLUMN lease_until");
  store = open_store(folder.path());
  EXPECT_EQ(phase(*store, id), StorePhase::done);
  EXPECT_TRUE(store->delete_scan(id));
}

TEST(Store, RefusesACatalogueOfANewerVersion) {
  const TemporaryFolder folder;
  open_store(folder.path()).reset();
  execute(folder.path() / "catalogue.sqlite", "PRAGMA user_version = 999");
  const auto store = Store::open(folder.path());
  ASSERT_FALSE(store);
  EXPECT_NE(store.error().message().find("newer version"), std::string::npos);
}

TEST(Store, RefusesADamagedCatalogue) {
  const TemporaryFolder folder;
  {
    const auto store = open_store(folder.path());
    for (int i = 0; i < 50; ++i) ASSERT_TRUE(store->open_scan(small_scan(), key, "rig"));
  }
  const fs::path file = folder.path() / "catalogue.sqlite";
  std::string bytes = read_file(file).value();
  ASSERT_GT(bytes.size(), 8192U);
  std::fill(bytes.begin() + 4096, bytes.end(), 'x');
  ASSERT_TRUE(write_file(file, bytes));
  EXPECT_FALSE(Store::open(folder.path()));
}

}  // namespace
}  // namespace gyre
