// SPDX-License-Identifier: Apache-2.0
// A paired device that sends mutated messages: the desk answers or refuses, and only ever touches that device's scans.
#include "common/bundle/sha256.h"
#include "offload/ingest/desk.h"
#include "tests/common/wire/sample_messages.h"
#include "tests/device/spool/scan_support.h"
#include "tests/fuzz/fuzz.h"

#include <gtest/gtest.h>
#include <cstdlib>
#include <nlohmann/json.hpp>

namespace gyre {
namespace {

constexpr const char* key = "its key";

struct Target {
  TemporaryFolder folder;
  std::unique_ptr<Store> store = Store::open(folder.path()).value();
  LinkBoard board;
  Desk desk{DeskOptions{1 << 20, 1 << 20, std::chrono::minutes(1), 0},
            *store,
            [](const std::string&) { return true; },
            [this](const std::string&, const wire::Message& message) {
              refused = refused || std::holds_alternative<wire::Refused>(message);
              return true;
            },
            [](const std::string&) {},
            board};
  Scan scan = small_scan();
  bool refused = true;

  void say(const wire::Message& message) { desk.receive("peer", key, wire::encode(message)); }
};

Target& target() {
  static Target one;
  return one;
}

}  // namespace
}  // namespace gyre

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  gyre::Target& target = gyre::target();
  if (std::exchange(target.refused, false)) {
    target.say(gyre::wire::Hello{gyre::wire::protocol_major, 1, "rig"});
    target.say(gyre::wire::ScanOpen{target.scan.id, gyre::to_json(target.scan).dump()});
  }
  target.desk.receive("peer", gyre::key, std::string_view(reinterpret_cast<const char*>(data), size));
  return 0;
}

namespace gyre {
namespace {

TEST(DeskFuzz, MutatedMessagesTouchNothingElse) {
  spdlog::set_level(spdlog::level::off);
  const Scan others = small_scan();
  ASSERT_TRUE(target().store->open_scan(others, "another key", "another"));
  const std::string picture(500, 'p');
  std::vector<std::string> corpus;
  for (const wire::Message& message : wire::sample_messages()) corpus.push_back(wire::encode(message));
  for (const std::string& scan : {target().scan.id, others.id}) {
    const wire::FileEntry file{keyframe_name(1), picture.size(), sha256(picture)};
    corpus.push_back(wire::encode(wire::FileChunk{scan, file, 0, picture}));
    corpus.push_back(wire::encode(wire::Discard{scan, file.name}));
    corpus.push_back(wire::encode(wire::ScanClose{scan, {file}}));
  }
  fuzz(corpus, 20'000);
  spdlog::set_level(spdlog::level::info);
  EXPECT_TRUE(target().store->files(others.id)->empty());
  EXPECT_EQ(target().store->scan(others.id).value()->phase, StorePhase::receiving);
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(target().folder.path(), error)) {
    const std::string name = entry.path().filename().string();
    EXPECT_TRUE(name == "scans" || name == "incoming" || name == "lock" || name.starts_with("catalogue.sqlite"))
        << name;
  }
  const std::vector<StoredScan> scans = target().store->scans().value();
  for (const StoredScan& scan : scans) {
    EXPECT_TRUE(scan.id == others.id || scan.device_key == key) << scan.id;
  }
}

}  // namespace
}  // namespace gyre
