// SPDX-License-Identifier: Apache-2.0
#include "offload/ingest/desk.h"

#include "common/bundle/sha256.h"
#include "tests/device/spool/scan_support.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace gyre {
namespace {

constexpr std::uint64_t credit = 1 << 20;

// A desk whose peers are tables of what they were sent.
class DeskTest : public testing::Test {
 protected:
  void SetUp() override {
    Result<std::unique_ptr<Store>> store = Store::open(folder_.path());
    ASSERT_TRUE(store);
    store_ = std::move(*store);
    start();
  }
  void start() {
    desk_ = std::make_unique<Desk>(
        DeskOptions{credit, 1 << 24, std::chrono::minutes(1), reserve_}, *store_,
        [this](const std::string& key) { return !shut_out_.contains(key); },
        [this](const std::string& peer, wire::Message message) {
          sent_[peer].push_back(std::move(message));
          return true;
        },
        [this](const std::string& scan) { queued_.push_back(scan); }, board_);
  }
  void say(const std::string& peer, const wire::Message& message) {
    desk_->receive(peer, "key of " + peer.substr(0, 1), wire::encode(message));
    if (const auto* chunk = std::get_if<wire::FileChunk>(&message)) desk_->settle(chunk->scan);
    if (const auto* close = std::get_if<wire::ScanClose>(&message)) desk_->settle(close->scan);
  }
  void greet(const std::string& peer) { say(peer, wire::Hello{wire::protocol_major, 0, peer}); }
  void open(const std::string& peer, const Scan& scan) { say(peer, wire::ScanOpen{scan.id, to_json(scan).dump()}); }

  // The last message of that kind a peer was sent, if any since the last call.
  template <class Kind>
  std::optional<Kind> heard(const std::string& peer) {
    std::optional<Kind> last;
    for (const wire::Message& message : sent_[peer]) {
      if (const auto* wanted = std::get_if<Kind>(&message)) last = *wanted;
    }
    sent_.erase(peer);
    return last;
  }

  static wire::FileChunk chunk_of(const std::string& scan, const std::string& name, const std::string& content,
                                  std::uint64_t offset, std::size_t size) {
    return {scan, {name, content.size(), sha256(content)}, offset, content.substr(offset, size)};
  }
  bool stored(const std::string& scan, const std::string& name) { return store_->file(scan, name).value().has_value(); }

  TemporaryFolder folder_;
  std::unique_ptr<Store> store_;
  LinkBoard board_;
  std::unique_ptr<Desk> desk_;
  std::map<std::string, std::vector<wire::Message>> sent_;
  std::vector<std::string> queued_;
  std::set<std::string> shut_out_;  // keys
  std::uint64_t reserve_ = 0;
  const Scan scan_ = small_scan();
  const std::string name_ = keyframe_name(1);
  const std::string content_ = std::string(1000, 'a') + std::string(1000, 'b');
};

TEST_F(DeskTest, NothingIsDoneBeforeHello) {
  open("a", scan_);
  EXPECT_TRUE(heard<wire::Refused>("a"));
  EXPECT_TRUE(store_->scans()->empty());
}

TEST_F(DeskTest, OnlyAScanOpenedHereMayBeTouched) {
  greet("a");
  say("a", chunk_of(scan_.id, name_, content_, 0, 1000));
  EXPECT_TRUE(heard<wire::Refused>("a"));
  greet("a");
  open("a", scan_);
  EXPECT_EQ(heard<wire::ScanState>("a")->phase, wire::ScanPhase::receiving);
  greet("b");
  open("b", scan_);
  EXPECT_EQ(heard<wire::ScanState>("b")->phase, wire::ScanPhase::refused);
  say("b", chunk_of(scan_.id, name_, content_, 0, 2000));
  EXPECT_TRUE(heard<wire::Refused>("b"));
  EXPECT_FALSE(stored(scan_.id, name_));
}

TEST_F(DeskTest, AFileIsAcknowledgedWhenItIsCompleteAndOnlyThen) {
  greet("a");
  open("a", scan_);
  say("a", chunk_of(scan_.id, name_, content_, 0, 1000));
  EXPECT_FALSE(heard<wire::FileAck>("a"));
  EXPECT_FALSE(stored(scan_.id, name_));
  say("a", chunk_of(scan_.id, name_, content_, 1000, 1000));
  EXPECT_EQ(heard<wire::FileAck>("a")->sha256, sha256(content_));
  EXPECT_EQ(sha256_of_file(store_->bundle(scan_.id).root() / name_).value(), sha256(content_));
}

TEST_F(DeskTest, DuplicatesAndOverlapsChangeNothing) {
  greet("a");
  open("a", scan_);
  say("a", chunk_of(scan_.id, name_, content_, 0, 1000));
  say("a", chunk_of(scan_.id, name_, content_, 0, 1000));
  say("a", chunk_of(scan_.id, name_, content_, 500, 1000));
  EXPECT_FALSE(heard<wire::FileAck>("a"));
  say("a", chunk_of(scan_.id, name_, content_, 1000, 1000));
  EXPECT_TRUE(heard<wire::FileAck>("a"));
  say("a", chunk_of(scan_.id, name_, content_, 1000, 1000));
  EXPECT_TRUE(heard<wire::FileAck>("a"));  // the acknowledgement may have been lost
  EXPECT_EQ(store_->files(scan_.id)->size(), 1U);
}

TEST_F(DeskTest, AGapIsAskedForOnce) {
  greet("a");
  open("a", scan_);
  say("a", chunk_of(scan_.id, name_, content_, 0, 500));
  say("a", chunk_of(scan_.id, name_, content_, 1000, 500));
  EXPECT_EQ(heard<wire::FileResume>("a")->offset, 500U);
  say("a", chunk_of(scan_.id, name_, content_, 1500, 500));
  EXPECT_FALSE(heard<wire::FileResume>("a"));
  say("a", chunk_of(scan_.id, name_, content_, 500, 1500));
  EXPECT_TRUE(heard<wire::FileAck>("a"));
}

TEST_F(DeskTest, DamagedContentIsNeverStored) {
  greet("a");
  open("a", scan_);
  wire::FileChunk damaged = chunk_of(scan_.id, name_, content_, 0, 2000);
  damaged.data[7] = 'X';
  say("a", damaged);
  EXPECT_EQ(heard<wire::FileResume>("a")->offset, 0U);
  EXPECT_FALSE(stored(scan_.id, name_));
  say("a", chunk_of(scan_.id, name_, content_, 0, 2000));
  EXPECT_TRUE(heard<wire::FileAck>("a"));
}

TEST_F(DeskTest, AfterARestartTheDeviceIsToldWhatIsHeld) {
  greet("a");
  open("a", scan_);
  const std::string other(300, 'c');
  say("a", chunk_of(scan_.id, keyframe_name(2), other, 0, 300));
  say("a", chunk_of(scan_.id, name_, content_, 0, 1234));
  start();
  greet("a");
  open("a", scan_);
  const auto state = heard<wire::ScanState>("a");
  ASSERT_TRUE(state);
  ASSERT_EQ(state->files.size(), 2U);
  EXPECT_EQ(state->files[0].file.name, keyframe_name(2));
  EXPECT_TRUE(state->files[0].stored);
  EXPECT_EQ(state->files[1].file.name, name_);
  EXPECT_EQ(state->files[1].file.sha256, sha256(content_));
  EXPECT_EQ(state->files[1].held, 1234U);
  EXPECT_FALSE(state->files[1].stored);
  say("a", chunk_of(scan_.id, name_, content_, 1234, 2000));
  EXPECT_TRUE(heard<wire::FileAck>("a"));
}

TEST_F(DeskTest, CreditIsNeverExceededAndComesBack) {
  greet("a");
  EXPECT_EQ(heard<wire::Credit>("a")->bytes, credit);
  open("a", scan_);
  const std::string large(3 << 20, 'l');
  std::uint64_t mine = credit;
  for (std::uint64_t offset = 0; offset < large.size(); offset += wire::max_chunk_bytes) {
    const std::uint64_t cost = wire::cost_of(wire::max_chunk_bytes);
    ASSERT_GE(mine, cost);
    mine -= cost;
    say("a", chunk_of(scan_.id, name_, large, offset, wire::max_chunk_bytes));
    ASSERT_FALSE(std::any_of(sent_["a"].begin(), sent_["a"].end(),
                             [](const auto& m) { return std::holds_alternative<wire::Refused>(m); }));
    if (const auto more = heard<wire::Credit>("a")) mine += more->bytes;
    ASSERT_LE(mine, credit);
  }
  EXPECT_TRUE(stored(scan_.id, name_));
}

TEST_F(DeskTest, AFileThatIsTooLargeIsRefused) {
  greet("a");
  open("a", scan_);
  say("a", wire::FileChunk{scan_.id, {name_, 1ULL << 40, std::string(64, 'a')}, 0, "x"});
  EXPECT_TRUE(heard<wire::Refused>("a"));
}

TEST_F(DeskTest, ADeviceThatIsShutOutIsToldAtOnceAndStaysOut) {
  greet("a");
  open("a", scan_);
  greet("b");
  shut_out_.insert("key of a");
  desk_->forget_gone();
  EXPECT_TRUE(heard<wire::Refused>("a")->permanent);
  EXPECT_FALSE(heard<wire::Refused>("b"));
  say("a", chunk_of(scan_.id, name_, content_, 0, 2000));
  EXPECT_TRUE(heard<wire::Refused>("a")->permanent);
  greet("a");  // on the connection it still has
  EXPECT_TRUE(heard<wire::Refused>("a")->permanent);
  EXPECT_FALSE(stored(scan_.id, name_));
  say("b", wire::Ping{});
  EXPECT_TRUE(heard<wire::Pong>("b"));
  shut_out_.clear();
  greet("a");
  EXPECT_TRUE(heard<wire::Welcome>("a"));
}

TEST_F(DeskTest, NoNewScanIsBegunOnANearlyFullDiskAndOneBegunGoesOn) {
  greet("a");
  open("a", scan_);
  reserve_ = ~0ULL;
  start();
  greet("a");
  const Scan other = small_scan();
  open("a", other);
  const auto refused = heard<wire::ScanState>("a");
  EXPECT_EQ(refused->phase, wire::ScanPhase::refused);
  EXPECT_NE(refused->text.find("nearly full"), std::string::npos);
  EXPECT_FALSE(store_->scan(other.id).value());
  open("a", scan_);
  EXPECT_EQ(heard<wire::ScanState>("a")->phase, wire::ScanPhase::receiving);
  say("a", chunk_of(scan_.id, name_, content_, 0, 2000));
  EXPECT_TRUE(heard<wire::FileAck>("a"));
}

TEST_F(DeskTest, ADeletedScanDoesNotComeBack) {
  greet("a");
  open("a", scan_);
  say("a", chunk_of(scan_.id, name_, content_, 0, 2000));
  start();
  ASSERT_TRUE(store_->delete_scan(scan_.id));
  greet("a");
  open("a", scan_);
  const auto refused = heard<wire::ScanState>("a");
  EXPECT_EQ(refused->phase, wire::ScanPhase::refused);
  EXPECT_NE(refused->text.find("deleted"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(store_->bundle(scan_.id).root()));
}

TEST_F(DeskTest, TheSameDeviceOnANewConnectionEndsTheOld) {
  greet("a-first");
  greet("a-second");
  say("a-first", wire::Ping{});
  EXPECT_TRUE(heard<wire::Refused>("a-first"));
  say("a-second", wire::Ping{});
  EXPECT_TRUE(heard<wire::Pong>("a-second"));
}

TEST_F(DeskTest, KeepsTheLastThatADeviceTellsOfItself) {
  say("a", wire::Hello{wire::protocol_major, 1, "rig-a", {"status"}, 0});
  const auto welcome = heard<wire::Welcome>("a");
  ASSERT_TRUE(welcome);
  EXPECT_TRUE(wire::has(welcome->capabilities, wire::takes_status));
  EXPECT_TRUE(wire::has(welcome->capabilities, wire::takes_coverage));
  EXPECT_EQ(welcome->deadline_ms, 60'000U);
  say("a", wire::CoveragePreview{scan_.id, "body", {{"body upper", 0.25, "c"}}});
  EXPECT_FALSE(board_.device("key of a")->coverage);  // its scan is not open
  open("a", scan_);
  say("a", wire::DeviceStatus{"ready", "", "", 1, 0, 0});
  say("a", wire::DeviceStatus{"recording", "walk on", scan_.id, 1 << 30, 1, 12});
  say("a", wire::CoveragePreview{scan_.id, "body", {{"body upper", 0.5, "cc"}}});
  const std::optional<DeviceView> device = board_.device("key of a");
  ASSERT_TRUE(device && device->status && device->coverage);
  EXPECT_TRUE(device->connected);
  EXPECT_EQ(device->name, "rig-a");
  EXPECT_EQ(device->capabilities, wire::Capabilities{"status"});
  EXPECT_EQ(device->status->state, "recording");
  EXPECT_EQ(device->status->waiting_files, 12U);
  EXPECT_EQ(device->coverage->bands.at(0).cells, "cc");
  EXPECT_FALSE(heard<wire::Refused>("a"));
  shut_out_.insert("key of a");
  say("a", wire::Ping{});
  EXPECT_FALSE(board_.device("key of a"));
}

TEST_F(DeskTest, ADeviceIsGoneAfterTheSilenceItAnnounced) {
  say("a", wire::Hello{wire::protocol_major, 1, "a", {}, 1});
  greet("b");
  EXPECT_TRUE(board_.device("key of a")->connected);
  ASSERT_TRUE(eventually([&] {
    desk_->forget_gone();
    return !board_.device("key of a")->connected;
  }));
  EXPECT_TRUE(board_.device("key of b")->connected);
}

TEST_F(DeskTest, CountsWhatCameAndWhoWasTurnedAway) {
  greet("a");
  open("a", scan_);
  say("a", chunk_of(scan_.id, name_, content_, 0, 2000));
  say("a", chunk_of(scan_.id, "frames.jsonl", content_, 1000, 1000));
  greet("a");
  greet("b");
  desk_->receive("b", "key of b", "\xff");
  say("c", wire::Hello{wire::protocol_major + 1, 0, "c"});
  const LinkCounts& counts = board_.counts;
  EXPECT_EQ(counts.connections, 3U);
  EXPECT_EQ(counts.reconnects, 1U);
  EXPECT_EQ(counts.received_bytes, 3000U);
  EXPECT_EQ(counts.received_files, 1U);
  EXPECT_EQ(counts.received_frames, 1U);
  EXPECT_EQ(counts.resumed_files, 1U);
  EXPECT_EQ(counts.refusals[static_cast<std::size_t>(RefusalKind::malformed)], 1U);
  EXPECT_EQ(counts.refusals[static_cast<std::size_t>(RefusalKind::protocol)], 1U);
}

class DeskClose : public DeskTest {
 protected:
  // Sends every file of a spooled scan but those in `missing`; returns the manifest.
  wire::ScanClose upload(Spool& spool, const std::set<std::string>& missing) {
    const SpooledScan scan = *spool.scan(scan_.id);
    wire::ScanClose manifest{scan_.id, {}};
    for (const SpooledFile& file : scan.files) {
      manifest.files.push_back({file.name, file.size, file.sha256});
      const std::string content = read(spool.bundle(scan_.id).root() / file.name);
      if (!missing.contains(file.name)) say("a", chunk_of(scan_.id, file.name, content, 0, content.size()));
    }
    return manifest;
  }
  static std::string read(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  TemporaryFolder device_;
};

TEST_F(DeskClose, QueuesACompleteScanOnceAndDropsWhatIsNotInIt) {
  const auto spool = Spool::open(device_.path()).value();
  ASSERT_TRUE(spool_scan(*spool, scan_, {1, 2}, 1000, 1));
  greet("a");
  open("a", scan_);
  say("a", chunk_of(scan_.id, keyframe_name(9), content_, 0, 2000));  // a candidate that was dropped
  const wire::ScanClose manifest = upload(*spool, {});
  std::ofstream(store_->bundle(scan_.id).frame("body", 8)) << "stray, as a crash leaves it";
  say("a", manifest);
  EXPECT_EQ(heard<wire::ScanState>("a")->phase, wire::ScanPhase::queued);
  EXPECT_EQ(list_frames(store_->bundle(scan_.id))->size(), 2U);
  EXPECT_EQ(store_->files(scan_.id)->size(), 4U);
  say("a", manifest);
  EXPECT_EQ(heard<wire::ScanState>("a")->phase, wire::ScanPhase::queued);
  say("a", chunk_of(scan_.id, keyframe_name(9), content_, 0, 2000));
  EXPECT_EQ(heard<wire::ScanState>("a")->phase, wire::ScanPhase::queued);
  EXPECT_FALSE(stored(scan_.id, keyframe_name(9)));
  EXPECT_EQ(queued_, std::vector{scan_.id});
}

TEST_F(DeskClose, WhatComesWhileAScanIsCheckedChangesNothing) {
  const auto spool = Spool::open(device_.path()).value();
  ASSERT_TRUE(spool_scan(*spool, scan_, {1, 2}, 1000, 1));
  greet("a");
  open("a", scan_);
  const wire::ScanClose manifest = upload(*spool, {});
  const auto say_on = [&](const wire::Message& message) { desk_->receive("a", "key of a", wire::encode(message)); };
  say_on(manifest);
  say_on(manifest);
  say_on(chunk_of(scan_.id, keyframe_name(9), content_, 0, 2000));
  say_on(wire::Discard{scan_.id, keyframe_name(1)});
  desk_->settle(scan_.id);
  EXPECT_EQ(heard<wire::ScanState>("a")->phase, wire::ScanPhase::queued);
  EXPECT_EQ(list_frames(store_->bundle(scan_.id))->size(), 2U);
  EXPECT_FALSE(std::filesystem::exists(store_->incoming(scan_.id)));
  EXPECT_EQ(queued_, std::vector{scan_.id});
}

TEST_F(DeskClose, AsksForWhatIsMissing) {
  const auto spool = Spool::open(device_.path()).value();
  ASSERT_TRUE(spool_scan(*spool, scan_, {1, 2}, 1000, 1));
  greet("a");
  open("a", scan_);
  const wire::ScanClose manifest = upload(*spool, {keyframe_name(2)});
  say("a", manifest);
  const auto state = heard<wire::ScanState>("a");
  EXPECT_EQ(state->phase, wire::ScanPhase::receiving);
  EXPECT_EQ(state->files.size(), 3U);
  // A file that vanished from the host's disk is missing too.
  std::filesystem::remove(store_->bundle(scan_.id).frame("body", 1));
  upload(*spool, {keyframe_name(1)});
  say("a", manifest);
  EXPECT_EQ(heard<wire::ScanState>("a")->phase, wire::ScanPhase::receiving);
  upload(*spool, {});
  say("a", manifest);
  EXPECT_EQ(heard<wire::ScanState>("a")->phase, wire::ScanPhase::queued);
}

TEST_F(DeskClose, AnEmptyManifestIsNoScan) {
  greet("a");
  open("a", scan_);
  say("a", wire::ScanClose{scan_.id, {}});
  EXPECT_NE(heard<wire::ScanState>("a")->phase, wire::ScanPhase::queued);
  EXPECT_TRUE(queued_.empty());
}

}  // namespace
}  // namespace gyre
