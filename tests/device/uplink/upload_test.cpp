// SPDX-License-Identifier: Apache-2.0
#include "device/uplink/upload.h"

#include "common/bundle/atomic_file.h"
#include "tests/device/spool/scan_support.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

// A connection of which the test plays the host.
class UploadTest : public testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(spool_->open_scan(scan_)); }
  void add(int index, std::size_t size) {
    ASSERT_TRUE(
        spool_->add_file(scan_.id, keyframe_name(index), small_keyframe(static_cast<std::uint64_t>(index), size)));
    upload_.refresh();
  }
  // The next message, which must be of that kind.
  template <class Kind>
  Kind next() {
    Result<std::optional<wire::Message>> message = upload_.next(now_);
    EXPECT_TRUE(message) << message.error().message();
    if (message && *message && std::holds_alternative<Kind>(**message)) return std::get<Kind>(std::move(**message));
    ADD_FAILURE() << "another message, or none";
    return {};
  }
  bool idle() { return !upload_.next(now_).value(); }
  void host_holds(std::vector<wire::HeldFile> files, wire::ScanPhase phase = wire::ScanPhase::receiving) {
    ASSERT_TRUE(upload_.on(wire::ScanState{scan_.id, phase, "reason", std::move(files)}, now_));
  }
  // Opens the scan at a host that has nothing of it and grants what is asked for.
  void begin(std::uint64_t credit) {
    EXPECT_EQ(next<wire::ScanOpen>().scan, scan_.id);
    EXPECT_TRUE(idle());  // nothing goes out before the host has said what it holds
    host_holds({});
    upload_.on(wire::Credit{credit}, now_);
  }
  void acknowledge(const wire::FileChunk& chunk) {
    ASSERT_TRUE(upload_.on(wire::FileAck{scan_.id, chunk.file.name, chunk.file.sha256}));
  }

  TemporaryFolder folder_;
  const std::unique_ptr<Spool> spool_ = Spool::open(folder_.path()).value();
  const Scan scan_ = small_scan();
  Upload upload_{*spool_};
  Pacer::Time now_{std::chrono::hours(1)};
};

TEST_F(UploadTest, SendsFilesInChunksAndWaitsForTheirAcknowledgement) {
  add(1, 2 * wire::max_chunk_bytes + 10);
  begin(1 << 24);
  const auto first = next<wire::FileChunk>();
  EXPECT_EQ(first.offset, 0U);
  EXPECT_EQ(next<wire::FileChunk>().offset, wire::max_chunk_bytes);
  const auto last = next<wire::FileChunk>();
  EXPECT_EQ(last.data.size(), 10U);
  EXPECT_TRUE(idle());
  ASSERT_TRUE(spool_->close_scan(scan_, small_records(2, {1})));
  upload_.refresh();
  const auto log = next<wire::FileChunk>();
  const auto description = next<wire::FileChunk>();
  EXPECT_EQ(log.file.name, "frames.jsonl");
  EXPECT_EQ(description.file.name, "scan.json");
  EXPECT_TRUE(idle());  // not closed while anything is not acknowledged
  for (const auto& chunk : {last, log, description}) acknowledge(chunk);
  EXPECT_EQ(next<wire::ScanClose>().files.size(), 3U);
  EXPECT_TRUE(idle());
  host_holds({}, wire::ScanPhase::queued);
  EXPECT_EQ(spool_->phase(scan_.id), SpoolPhase::acknowledged);
  EXPECT_TRUE(idle());
}

TEST_F(UploadTest, NeverSpendsMoreThanItsCredit) {
  add(1, 3 * wire::max_chunk_bytes);
  add(2, 100);
  const std::uint64_t chunk = wire::cost_of(wire::max_chunk_bytes);
  begin(2 * chunk - 1);
  next<wire::FileChunk>();
  EXPECT_TRUE(idle());
  upload_.on(wire::Credit{1}, now_);
  next<wire::FileChunk>();
  EXPECT_TRUE(idle());
  upload_.on(wire::Credit{chunk + wire::cost_of(99)}, now_);
  next<wire::FileChunk>();
  EXPECT_TRUE(idle());
  upload_.on(wire::Credit{wire::cost_of(1000)}, now_);
  EXPECT_EQ(next<wire::FileChunk>().file.name, keyframe_name(2));
}

TEST_F(UploadTest, GoesOnWhereTheHostStopped) {
  add(1, 1000);
  add(2, 1000);
  add(3, 1000);
  const SpooledScan now = *spool_->scan(scan_.id);
  const auto entry = [&](int i) {
    const SpooledFile& file = now.files[static_cast<std::size_t>(i)];
    return wire::FileEntry{file.name, file.size, file.sha256};
  };
  next<wire::ScanOpen>();
  upload_.on(wire::Credit{1 << 24}, now_);
  host_holds({{entry(0), 1000, true}, {entry(1), 400, false}, {entry(2), 1000, false}});
  const auto second = next<wire::FileChunk>();
  EXPECT_EQ(second.file.name, keyframe_name(2));
  EXPECT_EQ(second.offset, 400U);
  EXPECT_EQ(second.data.size(), 600U);
  const auto third = next<wire::FileChunk>();  // all there but not checked: the last chunk makes the host do so
  EXPECT_EQ(third.file.name, keyframe_name(3));
  EXPECT_FALSE(third.data.empty());
  EXPECT_EQ(third.offset + third.data.size(), 1000U);
  EXPECT_TRUE(idle());
  EXPECT_EQ(spool_->scan(scan_.id)->files[0].phase, SpooledFilePhase::acknowledged);
}

TEST_F(UploadTest, SendsAgainWhatTheHostAsksFor) {
  add(1, 1000);
  begin(1 << 24);
  const auto chunk = next<wire::FileChunk>();
  ASSERT_TRUE(upload_.on(wire::FileResume{scan_.id, chunk.file.name, chunk.file.sha256, 300}));
  EXPECT_EQ(next<wire::FileChunk>().offset, 300U);
  EXPECT_TRUE(idle());
}

TEST_F(UploadTest, AFileThatIsDamagedOnTheDeviceIsAnErrorNotALoop) {
  add(1, 1000);
  begin(1 << 24);
  const auto chunk = next<wire::FileChunk>();
  ASSERT_TRUE(write_file(spool_->bundle(scan_.id).root() / chunk.file.name, std::string(1000, 'x')));
  ASSERT_TRUE(upload_.on(wire::FileResume{scan_.id, chunk.file.name, chunk.file.sha256, 0}));
  EXPECT_FALSE(upload_.next(now_));
}

TEST_F(UploadTest, DropsACandidateInTheMiddle) {
  add(1, 3 * wire::max_chunk_bytes);
  add(2, 100);
  begin(1 << 24);
  EXPECT_EQ(next<wire::FileChunk>().file.name, keyframe_name(1));
  ASSERT_TRUE(spool_->discard(scan_.id, keyframe_name(1)));
  upload_.refresh();
  EXPECT_EQ(next<wire::Discard>().name, keyframe_name(1));
  EXPECT_EQ(next<wire::FileChunk>().file.name, keyframe_name(2));
  EXPECT_TRUE(idle());
  add(1, 50);  // chosen after all
  EXPECT_EQ(next<wire::FileChunk>().file.size, small_keyframe(1, 50).size());
}

TEST_F(UploadTest, TakesBackAcknowledgementsAHostDoesNotStandBy) {
  add(1, 1000);
  ASSERT_TRUE(spool_->close_scan(scan_, small_records(2, {1})));
  upload_.refresh();
  const SpooledScan now = *spool_->scan(scan_.id);
  for (const SpooledFile& file : now.files) {
    ASSERT_TRUE(spool_->acknowledge_file(scan_.id, file.name, file.sha256));
  }
  ASSERT_TRUE(spool_->acknowledge_scan(scan_.id));
  begin(1 << 24);
  EXPECT_EQ(spool_->phase(scan_.id), SpoolPhase::closed);
  for (int i = 0; i < 3; ++i) acknowledge(next<wire::FileChunk>());
  next<wire::ScanClose>();
}

TEST_F(UploadTest, AHostAtOddsWithItselfIsAnError) {
  ASSERT_TRUE(spool_->close_scan(scan_, {}));
  upload_.refresh();
  begin(1 << 24);
  bool ended = false;
  for (int i = 0; i < 20 && !ended; ++i) {
    acknowledge(next<wire::FileChunk>());
    acknowledge(next<wire::FileChunk>());
    next<wire::ScanClose>();
    ended = !upload_.on(wire::ScanState{scan_.id, wire::ScanPhase::receiving, "", {}}, now_);
  }
  EXPECT_TRUE(ended);
}

TEST_F(UploadTest, ARefusedScanDoesNotHoldUpTheNext) {
  const Scan later = small_scan();
  ASSERT_TRUE(spool_->open_scan(later));
  upload_.refresh();
  const std::string first = next<wire::ScanOpen>().scan;
  const std::string second = next<wire::ScanOpen>().scan;
  EXPECT_NE(first, second);
  ASSERT_TRUE(upload_.on(wire::ScanState{first, wire::ScanPhase::refused, "not yours", {}}, now_));
  ASSERT_TRUE(upload_.on(wire::ScanState{second, wire::ScanPhase::receiving, "", {}}, now_));
  upload_.on(wire::Credit{1 << 20}, now_);
  ASSERT_TRUE(spool_->add_file(first, keyframe_name(1), small_keyframe(1, 10)));
  ASSERT_TRUE(spool_->add_file(second, keyframe_name(1), small_keyframe(1, 10)));
  upload_.refresh();
  EXPECT_EQ(next<wire::FileChunk>().scan, second);
  EXPECT_TRUE(idle());
}

// A host that had no room may have some later, on the same connection.
TEST_F(UploadTest, ARefusedScanIsOfferedAgainAfterAWhile) {
  ASSERT_TRUE(spool_scan(*spool_, scan_, {1}, 1000, 1));
  EXPECT_EQ(next<wire::ScanOpen>().scan, scan_.id);
  host_holds({}, wire::ScanPhase::refused);
  EXPECT_TRUE(idle());
  now_ += std::chrono::seconds(59);
  EXPECT_TRUE(idle());
  now_ += std::chrono::seconds(2);
  EXPECT_EQ(next<wire::ScanOpen>().scan, scan_.id);
  EXPECT_TRUE(idle());
}

}  // namespace
}  // namespace gyre
