// SPDX-License-Identifier: Apache-2.0
#include "device/session/record_scan.h"

#include "common/bundle/atomic_file.h"
#include "common/bundle/ulid.h"
#include "tests/device/moving_scene.h"

#include <gtest/gtest.h>
#include <unistd.h>
#include <filesystem>

namespace gyre {
namespace {

namespace fs = std::filesystem;

// A camera that breaks after some frames, as a process does that is killed.
class BreakingScene : public test::MovingScene {
 public:
  BreakingScene(int frames, int good) : MovingScene(frames), good_(good) {}
  Result<CameraEvent> next(std::chrono::milliseconds timeout) override {
    if (good_-- == 0) return fail("the camera is gone");
    return MovingScene::next(timeout);
  }

 private:
  int good_;
};

class Session : public testing::Test {
 protected:
  void SetUp() override {
    const std::string name = testing::UnitTest::GetInstance()->current_test_info()->name();
    folder_ = fs::temp_directory_path() / ("gyre-session-" + name + "-" + std::to_string(::getpid()));
    fs::remove_all(folder_);
    open();
    scan_.id = new_ulid();
    scan_.created = "2025-01-01T00:00:00Z";
    scan_.device = "rig";
    scan_.height_mm = 1700.0;
  }
  void TearDown() override {
    spool_.reset();
    fs::remove_all(folder_);
  }

  void open() {
    spool_.reset();
    Result<std::unique_ptr<Spool>> spool = Spool::open(folder_);
    ASSERT_TRUE(spool) << spool.error().message();
    spool_ = std::move(*spool);
  }

  Result<RecordingSummary> record(CameraDevice& body, CameraDevice* head = nullptr) {
    std::vector<PassPlan> passes = {{"body", &body}};
    if (head != nullptr) passes.push_back({"head", head});
    return record_scan(*spool_, scan_, passes, {}, [](double, std::string_view) {});
  }

  // Name to content of the files that make the bundle.
  std::map<std::string, std::string> content() const {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(bundle().root())) {
      if (entry.is_regular_file() && entry.path().filename() != "spool.jsonl") {
        files[fs::relative(entry.path(), bundle().root()).string()] = read_file(entry.path()).value();
      }
    }
    return files;
  }
  Bundle bundle() const { return spool_->bundle(scan_.id); }

  fs::path folder_;
  std::unique_ptr<Spool> spool_;
  Scan scan_;
};

TEST_F(Session, LeavesAWholeBundle) {
  test::MovingScene body(120);
  test::MovingScene head(60);
  const Result<RecordingSummary> summary = record(body, &head);
  ASSERT_TRUE(summary) << summary.error().message();
  EXPECT_EQ(summary->frames, 180);
  EXPECT_EQ(summary->keyframes, 60);
  EXPECT_EQ(spool_->phase(scan_.id), SpoolPhase::closed);

  const Result<void> verified = verify_bundle(bundle());
  EXPECT_TRUE(verified) << verified.error().message();
  const Result<Scan> written = read_scan(bundle());
  ASSERT_TRUE(written);
  EXPECT_EQ(written->height_mm, 1700.0);
  EXPECT_EQ(written->device, "rig");
  ASSERT_EQ(written->passes.size(), 2U);
  EXPECT_EQ(written->passes[1].name, "head");
  EXPECT_EQ(written->passes[1].frame_count, 60);
  EXPECT_EQ(written->passes[0].width, 96);

  const std::vector<FrameRecord> records = read_frame_log(bundle()).value();
  EXPECT_EQ(records.size(), 180U);
  for (const FrameRecord& record : records) EXPECT_FALSE(record.reason.empty());
}

TEST_F(Session, SomeKeyframesAreSpooledEarlyAndTheRestIsRecalled) {
  test::MovingScene body(150);
  const Result<RecordingSummary> summary = record(body);
  ASSERT_TRUE(summary);
  EXPECT_GT(summary->early_proposed, 0);
  EXPECT_EQ(summary->early_proposed + static_cast<int>(body.recalled().size()), summary->keyframes);
  EXPECT_EQ(list_frames(bundle())->size(), static_cast<std::size_t>(summary->keyframes));
}

TEST_F(Session, AcknowledgedKeyframesCountAsSentEarly) {
  // The host acknowledges everything at once.
  spool_->on_change({});
  test::MovingScene first(120);
  BreakingScene broken(120, 100);
  ASSERT_FALSE(record(broken));
  const std::optional<SpooledScan> spooled = spool_->scan(scan_.id);
  ASSERT_TRUE(spooled);
  for (const SpooledFile& file : spooled->files) {
    ASSERT_TRUE(spool_->acknowledge_file(scan_.id, file.name, file.sha256));
  }
  const Result<RecordingSummary> summary = record(first);
  ASSERT_TRUE(summary);
  EXPECT_GT(summary->early_keyframes, 0);
  EXPECT_LE(summary->early_keyframes, summary->early_proposed);
}

TEST_F(Session, ACrashAtAnyFrameEndsWithTheSameScan) {
  test::MovingScene whole(90);
  ASSERT_TRUE(record(whole));
  const std::map<std::string, std::string> expected = content();

  for (const int good : {0, 1, 9, 10, 47, 89}) {
    scan_.id = new_ulid();
    BreakingScene broken(90, good);
    EXPECT_FALSE(record(broken));
    open();
    test::MovingScene again(90);
    ASSERT_TRUE(record(again)) << good;
    std::map<std::string, std::string> found = content();
    EXPECT_EQ(scan_from_json(nlohmann::json::parse(found["scan.json"]))->id, scan_.id);
    found["scan.json"] = expected.at("scan.json");  // differs in its id
    EXPECT_EQ(found, expected) << good;
  }
}

TEST_F(Session, AClosedScanIsLeftAlone) {
  test::MovingScene body(60);
  ASSERT_TRUE(record(body));
  const std::map<std::string, std::string> before = content();
  test::MovingScene other(90);
  const Result<RecordingSummary> again = record(other);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->frames, 0);
  EXPECT_EQ(content(), before);
}

TEST_F(Session, NothingIsLeftOfARecordingThatCannotBeUsed) {
  test::MovingScene still(60, 0);
  const Result<RecordingSummary> motionless = record(still);
  ASSERT_FALSE(motionless);
  EXPECT_NE(motionless.error().message().find("did not move"), std::string::npos);
  test::MovingScene brief(7);
  const Result<RecordingSummary> few = record(brief);
  ASSERT_FALSE(few);
  EXPECT_NE(few.error().message().find("too few frames"), std::string::npos);
  EXPECT_TRUE(spool_->scan_ids().empty());
}

TEST_F(Session, ASilentCameraIsAnError) {
  class Silent : public test::MovingScene {
   public:
    Silent() : MovingScene(10) {}
    Result<CameraEvent> next(std::chrono::milliseconds) override { return CameraEvent{}; }
  };
  Silent silent;
  const Result<RecordingSummary> summary = record(silent);
  ASSERT_FALSE(summary);
  EXPECT_NE(summary.error().message().find("silent"), std::string::npos);
}

}  // namespace
}  // namespace gyre
