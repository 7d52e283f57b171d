// SPDX-License-Identifier: Apache-2.0
#include "device/session/session_store.h"

#include "common/bundle/atomic_file.h"
#include "common/bundle/ulid.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

class SessionStoreTest : public testing::Test {
 protected:
  TemporaryFolder folder_;
  SessionStore store_{folder_.path()};
};

TEST_F(SessionStoreTest, WhatWasSavedIsLoaded) {
  EXPECT_FALSE(store_.load());
  StoredSession session;
  session.state = SessionState::between_passes;
  session.pass = "head";
  session.scan = Scan{.id = new_ulid(), .device = "rig", .created = "2026-01-01T00:00:00Z", .height_mm = 1650.0};
  session.scan->passes.push_back({"body", 30.0, 812, 1280, 720, 26.0});
  ASSERT_TRUE(store_.save(session));
  const std::optional<StoredSession> found = SessionStore(folder_.path()).load();
  ASSERT_TRUE(found && found->scan);
  EXPECT_EQ(found->state, session.state);
  EXPECT_EQ(found->pass, "head");
  EXPECT_EQ(found->scan->id, session.scan->id);
  EXPECT_EQ(found->scan->height_mm, 1650.0);
  ASSERT_EQ(found->scan->passes.size(), 1U);
  EXPECT_EQ(found->scan->passes[0].frame_count, 812);
  ASSERT_TRUE(store_.save({}));
  ASSERT_TRUE(store_.load());
  EXPECT_FALSE(store_.load()->scan);
}

TEST_F(SessionStoreTest, DamageCountsAsNothing) {
  ASSERT_TRUE(store_.save({}));
  const auto file = folder_.path() / "session" / "session.json";
  const std::string good = read_file(file).value();
  for (const std::string& bad :
       {std::string(), std::string("{"), std::string("[1]"), good.substr(0, good.size() / 2),
        std::string(R"({"version": "1", "state": 3, "pass": [], "scan": 5})"),
        std::string(R"({"version": 1, "state": "asleep", "pass": "body", "scan": null})"),
        std::string(R"({"version": 1, "state": "idle", "pass": "body", "scan": {"id": 4}})")}) {
    ASSERT_TRUE(write_file(file, bad));
    EXPECT_FALSE(store_.load()) << bad;
  }
}

TEST_F(SessionStoreTest, WhatACrashLeftHalfWrittenIsRemoved) {
  ASSERT_TRUE(store_.save({}));
  const auto half = folder_.path() / "session" / "session.json.part12-34";
  ASSERT_TRUE(write_file(half, std::string_view(R"({"versi)")));
  store_.tidy();
  EXPECT_FALSE(std::filesystem::exists(half));
  EXPECT_TRUE(store_.load());
}

TEST_F(SessionStoreTest, RecordsAreKeptUntilTheyAreForgotten) {
  std::vector<FrameRecord> records(3);
  for (int i = 0; i < 3; ++i) {
    records[static_cast<std::size_t>(i)].pass = "body";
    records[static_cast<std::size_t>(i)].index = i;
    records[static_cast<std::size_t>(i)].azimuth = 1.5 * i;
    records[static_cast<std::size_t>(i)].decision = "skipped";
    records[static_cast<std::size_t>(i)].reason = "why";
  }
  ASSERT_TRUE(store_.save_records("scan", "body", records));
  const Result<std::vector<FrameRecord>> found = store_.load_records("scan", "body");
  ASSERT_TRUE(found);
  ASSERT_EQ(found->size(), 3U);
  EXPECT_EQ((*found)[2].azimuth, 3.0);
  store_.forget_records();
  EXPECT_FALSE(store_.load_records("scan", "body"));
  ASSERT_TRUE(write_file(folder_.path() / "session" / "scan-body.jsonl", std::string_view("{}\nno\n")));
  EXPECT_FALSE(store_.load_records("scan", "body"));
}

}  // namespace
}  // namespace gyre
