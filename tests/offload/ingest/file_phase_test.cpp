// SPDX-License-Identifier: Apache-2.0
// The states of a file on the host, walked with real messages to a real store: every event in every state.
#include "common/bundle/sha256.h"
#include "offload/ingest/receiver.h"
#include "tests/device/spool/scan_support.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

namespace fs = std::filesystem;

enum class Phase {
  announced,     // known by name, nothing of it here
  receiving,     // its first bytes are here
  stored,        // whole and synced in the bundle, not catalogued: the host was killed in between
  acknowledged,  // catalogued too
};
enum class Event {
  chunk,      // the next bytes
  gap,        // bytes after a hole
  rest,       // all the bytes that are missing
  damaged,    // all the bytes that are missing, some of them wrong
  discarded,  // the device dropped it
  vanished,   // it is gone from the host's disk, and the host looks
};

// README.md has the same table.
const std::map<Phase, std::map<Event, Phase>> table = {
    {Phase::announced,
     {{Event::chunk, Phase::receiving},
      {Event::gap, Phase::announced},
      {Event::rest, Phase::acknowledged},
      {Event::damaged, Phase::announced},
      {Event::discarded, Phase::announced},
      {Event::vanished, Phase::announced}}},
    {Phase::receiving,
     {{Event::chunk, Phase::receiving},
      {Event::gap, Phase::receiving},
      {Event::rest, Phase::acknowledged},
      {Event::damaged, Phase::announced},
      {Event::discarded, Phase::announced},
      {Event::vanished, Phase::announced}}},
    {Phase::stored,
     {{Event::chunk, Phase::receiving},
      {Event::gap, Phase::stored},
      {Event::rest, Phase::acknowledged},
      {Event::damaged, Phase::stored},
      {Event::discarded, Phase::announced},
      {Event::vanished, Phase::announced}}},
    {Phase::acknowledged,
     {{Event::chunk, Phase::acknowledged},
      {Event::gap, Phase::acknowledged},
      {Event::rest, Phase::acknowledged},
      {Event::damaged, Phase::acknowledged},
      {Event::discarded, Phase::announced},
      {Event::vanished, Phase::announced}}},
};

class FilePhase : public testing::Test {
 protected:
  void SetUp() override {
    store_ = Store::open(folder_.path()).value();
    receiver_ = std::make_unique<Receiver>(*store_, 1 << 20, counts_);
    ASSERT_TRUE(store_->open_scan(scan_, "key", "rig"));
  }
  std::optional<wire::Message> send(std::uint64_t offset, std::string data) {
    wire::FileChunk chunk{scan_.id, {name_, content_.size(), sha256(content_)}, offset, std::move(data)};
    const Result<std::optional<wire::Message>> answer = receiver_->accept(chunk);
    EXPECT_TRUE(answer) << answer.error().message();
    return answer.value_or(std::nullopt);
  }
  fs::path file() const { return store_->bundle(scan_.id).root() / name_; }
  void remove_parts() {
    fs::remove_all(store_->incoming(scan_.id));
    fs::create_directories(store_->incoming(scan_.id));
  }

  void bring_to(Phase phase) {
    if (phase == Phase::receiving) send(0, content_.substr(0, 100));
    if (phase == Phase::stored || phase == Phase::acknowledged) send(0, content_);
    if (phase == Phase::stored) {
      ASSERT_TRUE(store_->remove_file(scan_.id, name_));
    }
  }
  void make_happen(Event event) {
    const std::uint64_t held = phase() == Phase::receiving ? 100 : 0;
    std::string rest = content_.substr(held);
    switch (event) {
      case Event::chunk:
        send(held, rest.substr(0, 50));
        break;
      case Event::gap:
        send(held + 50, content_.substr(held + 50, 50));
        break;
      case Event::rest:
        EXPECT_TRUE(std::holds_alternative<wire::FileAck>(send(held, rest).value()));
        break;
      case Event::damaged:
        rest[0] = 'X';
        send(held, rest);
        break;
      case Event::discarded:
        ASSERT_TRUE(receiver_->discard({scan_.id, name_}));
        break;
      case Event::vanished:
        fs::remove(file());
        remove_parts();
        ASSERT_TRUE(receiver_->state(scan_.id));
        break;
    }
  }
  // What disk and catalogue say.
  Phase phase() const {
    if (store_->file(scan_.id, name_).value()) return Phase::acknowledged;
    if (!fs::is_empty(store_->incoming(scan_.id))) return Phase::receiving;
    return fs::exists(file()) ? Phase::stored : Phase::announced;
  }

  TemporaryFolder folder_;
  std::unique_ptr<Store> store_;
  LinkCounts counts_;
  std::unique_ptr<Receiver> receiver_;
  const Scan scan_ = small_scan();
  const std::string name_ = keyframe_name(1);
  const std::string content_ = std::string(500, 'a') + std::string(500, 'b');
};

TEST_F(FilePhase, EveryEventInEveryPhaseLeadsWhereTheTableSays) {
  for (const auto& [from, events] : table) {
    for (const auto& [event, to] : events) {
      SCOPED_TRACE(std::to_string(static_cast<int>(from)) + " + " + std::to_string(static_cast<int>(event)));
      ASSERT_TRUE(receiver_->discard({scan_.id, name_}));
      remove_parts();
      receiver_ = std::make_unique<Receiver>(*store_, 1 << 20, counts_);
      bring_to(from);
      ASSERT_EQ(phase(), from);
      make_happen(event);
      EXPECT_EQ(phase(), to);
      // From wherever that is, the file gets here whole.
      send(0, content_);
      EXPECT_EQ(sha256_of_file(file()).value(), sha256(content_));
      EXPECT_TRUE(store_->file(scan_.id, name_).value());
    }
  }
}

}  // namespace
}  // namespace gyre
