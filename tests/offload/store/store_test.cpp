// SPDX-License-Identifier: Apache-2.0
#include "offload/store/store.h"

#include "common/bundle/atomic_file.h"
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
  EXPECT_EQ(store->take_job().value(), scan.id);
  EXPECT_EQ(phase(*store, scan.id), StorePhase::running);
  EXPECT_FALSE(store->take_job().value());

  store.reset();
  store = open_store(folder.path());  // the host went down while the job ran
  EXPECT_EQ(phase(*store, scan.id), StorePhase::queued);
  EXPECT_EQ(store->take_job().value(), scan.id);
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
  EXPECT_EQ(store->take_job().value(), ids.front());
  std::vector<std::string> taken[2];
  {
    std::vector<std::thread> takers;
    for (auto& mine : taken) {
      takers.emplace_back([&store, &mine] {
        while (const std::optional<std::string> id = store->take_job().value()) mine.push_back(*id);
      });
    }
    for (std::thread& taker : takers) taker.join();
  }
  std::vector<std::string> all = {ids.front()};
  for (const auto& mine : taken) all.insert(all.end(), mine.begin(), mine.end());
  std::sort(all.begin(), all.end());
  EXPECT_EQ(all, ids);
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
