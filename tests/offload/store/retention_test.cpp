// SPDX-License-Identifier: Apache-2.0
#include "offload/store/retention.h"

#include "common/bundle/atomic_file.h"
#include "common/bundle/sha256.h"
#include "offload/store/receipts.h"
#include "tests/device/spool/scan_support.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace gyre {
namespace {

using nlohmann::json;
using std::chrono::hours;

class RetentionTest : public testing::Test {
 protected:
  void SetUp() override { store_ = Store::open(folder_.path()).value(); }
  // A scan whose results were delivered at that time.
  std::string delivered(WallTime at) {
    const Scan scan = small_scan();
    EXPECT_TRUE(store_->open_scan(scan, "key", "rig-1"));
    EXPECT_TRUE(write_file(store_->bundle(scan.id).frame("body", 1), "picture"));
    EXPECT_TRUE(store_->queue_job(scan.id));
    EXPECT_TRUE(store_->take_job());
    EXPECT_TRUE(store_->finish_job(scan.id, {}));
    EXPECT_TRUE(store_->set_delivered(scan.id, at));
    return scan.id;
  }
  std::vector<json> receipts() const {
    std::istringstream lines(read_file(folder_.path() / "receipts.jsonl").value_or(""));
    std::vector<json> all;
    for (std::string line; std::getline(lines, line);) all.push_back(json::parse(line));
    return all;
  }
  TemporaryFolder folder_;
  std::unique_ptr<Store> store_;
};

TEST_F(RetentionTest, DeletesAtOnceAndAgainWithReceipts) {
  const WallTime start = wall_time_now();
  const std::string old = delivered(start - hours(50));
  const std::string young = delivered(start - hours(10));
  std::atomic<int> later_hours = 0;
  Retention retention({hours(24), {}}, *store_, std::chrono::milliseconds(1),
                      [&] { return start + hours(later_hours); });
  retention.start();
  ASSERT_TRUE(eventually([&] { return retention.deleted() == 1; }));
  EXPECT_FALSE(store_->scan(old).value());
  EXPECT_TRUE(store_->scan(young).value());
  later_hours = 20;
  ASSERT_TRUE(eventually([&] { return retention.deleted() == 2; }));
  retention.stop();
  EXPECT_FALSE(std::filesystem::exists(store_->bundle(young).root()));
  const std::vector<json> all = receipts();
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].at("deleted"), old);
  EXPECT_EQ(all[0].at("device"), "rig-1");
  EXPECT_EQ(all[0].at("why"), "by the retention policy");
  const json& files = all[0].at("files");
  EXPECT_TRUE(std::any_of(files.begin(), files.end(), [&](const json& file) {
    return file.at("name") == "scans/" + old + "/frames/body-000001.jpg" && file.at("sha256") == sha256("picture");
  })) << files;
}

TEST_F(RetentionTest, WithoutAPolicyNothingGoes) {
  const std::string scan = delivered(wall_time_now() - hours(100'000));
  Retention retention({}, *store_, std::chrono::milliseconds(1));
  retention.start();
  retention.stop();
  EXPECT_TRUE(store_->scan(scan).value());
}

}  // namespace
}  // namespace gyre
