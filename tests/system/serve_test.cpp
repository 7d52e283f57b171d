// SPDX-License-Identifier: Apache-2.0
// The host as a service beside its other verbs: what an operator does with the real programs.
#include "common/bundle/atomic_file.h"
#include "common/bundle/sha256.h"
#include "common/bundle/ulid.h"
#include "common/keys/keys.h"
#include "offload/store/store.h"
#include "tests/device/spool/scan_support.h"
#include "tests/system/programs.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <httplib.h>
#include <csignal>
#include <nlohmann/json.hpp>

namespace gyre {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class ServeTest : public testing::Test {
 protected:
  void start_host(const std::vector<std::string>& before = {}, const std::vector<std::string>& after = {}) {
    fs::create_directories(root_ / "host");
    fs::remove(root_ / "ready.json");
    std::vector<std::string> words = before;
    for (const std::string& word :
         {std::string("serve"), std::string("--store"), at("host"), std::string("--endpoint"),
          std::string("tcp://127.0.0.1:*"), std::string("--page"), std::string("127.0.0.1:0")}) {
      words.push_back(word);
    }
    words.insert(words.end(), after.begin(), after.end());
    host_ = std::make_unique<Running>("gyre-offload", words, root_ / "ready.json", root_ / "host.log");
    ready_ = json::parse(first_line(root_ / "ready.json", *host_));
  }
  std::string at(const std::string& name) const { return (root_ / name).string(); }

  TemporaryFolder folder_;
  fs::path root_ = folder_.path();
  std::unique_ptr<Running> host_;
  json ready_;
};

TEST_F(ServeTest, ADeviceIsPairedByCodeAndShutOutAgainWhileTheHostServes) {
  start_host();
  Running pairing("gyre-offload", {"pair", "--store", at("host"), "--endpoint", "tcp://127.0.0.1:*"},
                  root_ / "pair.json", root_ / "pair.log");
  const json offer = json::parse(first_line(root_ / "pair.json", pairing));
  const std::string endpoint = offer.at("endpoint");
  const Finished wrong = run_program("gyre-device", {"pair", endpoint, "AAAA-AAAA", "--keys", at("keys")});
  EXPECT_EQ(wrong.code, 1);
  EXPECT_FALSE(fs::exists(root_ / "keys" / "host.pub"));
  EXPECT_EQ(run_program("gyre-device", {"pair", endpoint, "short", "--keys", at("keys")}).code, 2);
  const Finished paired =
      run_program("gyre-device", {"pair", endpoint, offer.at("code"), "--keys", at("keys"), "--name", "rig-1"});
  ASSERT_EQ(paired.code, 0) << paired.err;
  EXPECT_EQ(json::parse(paired.out).at("host_public_key"), ready_.at("public_key"));
  EXPECT_EQ(pairing.wait(), 0);
  const std::string log = read_file(root_ / "pair.log").value();
  EXPECT_EQ(log.find(read_key_pair(root_ / "keys" / "device.key").value().secret_key.reveal()), std::string::npos);
  EXPECT_EQ(log.find(offer.at("code").get<std::string>()), std::string::npos);

  const auto devices = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words = {"pair", "--store", at("host")};
    words.insert(words.end(), more.begin(), more.end());
    return json::parse(run_program("gyre-offload", words).out).at("devices");
  };
  EXPECT_EQ(devices({"--list"}).at(0).at("name"), "rig-1");
  EXPECT_TRUE(devices({"--revoke", "rig-1"}).empty());
  EXPECT_EQ(host_->stop(), 0);
}

TEST_F(ServeTest, TheStoreIsListedVerifiedAndCleanedWhenTheHostIsDown) {
  Scan scan;
  scan.id = new_ulid();
  scan.created = "2026-01-01T00:00:00Z";
  {
    const auto store = Store::open(root_ / "host").value();
    ASSERT_TRUE(store->open_scan(scan, "a key", "rig-1"));
    ASSERT_TRUE(write_file(store->bundle(scan.id).frame("body", 1), std::string_view("picture")));
    ASSERT_TRUE(store->add_file(scan.id, {"frames/body-000001.jpg", 7, sha256("picture")}));
  }
  const auto store_verb = [&](const std::string& verb, const std::vector<std::string>& scans) {
    std::vector<std::string> words = {"store", verb, "--store", at("host")};
    words.insert(words.end(), scans.begin(), scans.end());
    return run_program("gyre-offload", words);
  };
  start_host();
  const Finished busy = store_verb("delete", {scan.id});
  EXPECT_EQ(busy.code, 1);
  EXPECT_NE(busy.err.find("in use by another process"), std::string::npos) << busy.err;
  EXPECT_EQ(host_->stop(), 0);

  const json listed = json::parse(store_verb("list", {}).out);
  EXPECT_EQ(listed.at("scan"), scan.id);
  EXPECT_EQ(listed.at("phase"), "receiving");
  EXPECT_EQ(listed.at("bytes"), 7);
  EXPECT_EQ(store_verb("verify", {}).code, 0);
  ASSERT_TRUE(
      write_file(root_ / "host" / "scans" / scan.id / "frames" / "body-000001.jpg", std::string_view("PICTURE")));
  const Finished damaged = store_verb("verify", {scan.id});
  EXPECT_EQ(damaged.code, 1);
  EXPECT_EQ(json::parse(damaged.out).at("faults").at(0), "frames/body-000001.jpg differs from its hash");
  const Finished deleted = store_verb("delete", {scan.id});
  EXPECT_EQ(deleted.code, 0) << deleted.err;
  EXPECT_EQ(json::parse(deleted.out).at("files").size(), 2U);
  EXPECT_FALSE(fs::exists(root_ / "host" / "scans" / scan.id));
  EXPECT_EQ(store_verb("delete", {scan.id}).code, 1);
  EXPECT_TRUE(store_verb("list", {}).out.empty());
  EXPECT_EQ(run_program("gyre-offload", {"store", "--store", at("host")}).code, 2);
}

// Lines of the log, each of which has to be an object.
std::vector<json> json_lines(const fs::path& file) {
  std::istringstream text(read_file(file).value_or(""));
  std::vector<json> lines;
  for (std::string line; std::getline(text, line);) lines.push_back(json::parse(line));
  return lines;
}

bool says(const std::vector<json>& lines, const std::string& text) {
  return std::any_of(lines.begin(), lines.end(), [&](const json& line) {
    return line.at("message").get<std::string>().find(text) != std::string::npos;
  });
}

TEST_F(ServeTest, TellsMetricsHealthAndJsonLogsWhoseLevelChanges) {
  start_host({"--log-format", "json"});
  const std::string page = ready_.at("page");
  httplib::Client client(page.substr(0, page.size() - 1));
  const auto metrics = client.Get("/metrics");
  ASSERT_TRUE(metrics);
  EXPECT_EQ(metrics->status, 200);
  for (const char* line :
       {"# TYPE gyre_received_bytes_total counter\n", "gyre_scans{phase=\"queued\"} 0\n", "gyre_devices_connected 0\n",
        "gyre_refusals_total{reason=\"unknown_key\"} 0\n", "gyre_jobs_ended_total{how=\"failed\"} 0\n"}) {
    EXPECT_NE(metrics->body.find(line), std::string::npos) << line;
  }
  const auto health = client.Get("/health");
  ASSERT_TRUE(health);
  EXPECT_EQ(health->status, 200);
  EXPECT_EQ(json::parse(health->body), json({{"status", "ok"}, {"checks", {{"disk", "ok"}, {"store", "ok"}}}}));

  host_->signal(SIGUSR1);
  const auto logged = [&](const char* text) { return says(json_lines(root_ / "host.log"), text); };
  ASSERT_TRUE(eventually([&] { return logged("from level debug on"); }));
  host_->signal(SIGUSR2);
  ASSERT_TRUE(eventually([&] { return logged("from level info on"); }));
  host_->signal(SIGUSR2);
  ASSERT_TRUE(eventually([&] { return logged("from level warning on"); }));
  EXPECT_EQ(host_->stop(), 0);
  EXPECT_EQ(json_lines(root_ / "host.log").front().at("program"), "gyre-offload");
}

TEST_F(ServeTest, DeletesWhatHasBeenKeptLongEnough) {
  std::vector<std::string> ids;
  {
    const auto store = Store::open(root_ / "host").value();
    for (int i = 0; i < 2; ++i) {
      Scan scan;
      scan.id = ids.emplace_back(new_ulid());
      scan.created = "2026-01-01T00:00:00Z";
      ASSERT_TRUE(store->open_scan(scan, "a key", "rig-1"));
      ASSERT_TRUE(store->queue_job(scan.id));
      ASSERT_TRUE(store->take_job());
      ASSERT_TRUE(store->finish_job(scan.id, {}));
      ASSERT_TRUE(store->set_delivered(scan.id, wall_time_now() - std::chrono::hours(24 * (i == 0 ? 40 : 5))));
    }
  }
  start_host({"--log-format", "json"}, {"--keep-days", "30"});
  ASSERT_TRUE(eventually([&] { return fs::exists(root_ / "host" / "receipts.jsonl"); }));
  EXPECT_EQ(host_->stop(), 0);
  EXPECT_EQ(json::parse(last_line(read_file(root_ / "host" / "receipts.jsonl").value())).at("deleted"), ids[0]);
  EXPECT_FALSE(fs::exists(root_ / "host" / "scans" / ids[0]));
  EXPECT_TRUE(fs::exists(root_ / "host" / "scans" / ids[1]));
  const std::vector<json> lines = json_lines(root_ / "host.log");
  EXPECT_TRUE(std::any_of(lines.begin(), lines.end(), [&](const json& line) {
    return line.value("scan", "") == ids[0] &&
           line.at("message").get<std::string>().find("by the retention policy") != std::string::npos;
  }));
}

}  // namespace
}  // namespace gyre
