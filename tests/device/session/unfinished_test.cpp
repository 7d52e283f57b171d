// SPDX-License-Identifier: Apache-2.0
#include "device/session/unfinished.h"

#include "common/bundle/atomic_file.h"
#include "common/bundle/ulid.h"

#include <gtest/gtest.h>
#include <unistd.h>

namespace gyre {
namespace {

namespace fs = std::filesystem;

class Unfinished : public testing::Test {
 protected:
  void SetUp() override {
    const std::string name = testing::UnitTest::GetInstance()->current_test_info()->name();
    folder_ = fs::temp_directory_path() / ("gyre-unfinished-" + name + "-" + std::to_string(::getpid()));
    fs::remove_all(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path folder_;
};

TEST_F(Unfinished, TheSameRequestGoesOnUntilItEnds) {
  const UnfinishedScan first = begin_scan(folder_, "a").value();
  EXPECT_TRUE(is_ulid(first.id));
  EXPECT_FALSE(first.resumed);
  const UnfinishedScan again = begin_scan(folder_, "a").value();
  EXPECT_TRUE(again.resumed);
  EXPECT_EQ(again.id, first.id);
  EXPECT_EQ(again.created, first.created);
  EXPECT_NE(begin_scan(folder_, "b")->id, first.id);
  end_scan(folder_, "a");
  end_scan(folder_, "a");
  EXPECT_NE(begin_scan(folder_, "a")->id, first.id);
}

TEST_F(Unfinished, ADamagedEntryIsNone) {
  const UnfinishedScan first = begin_scan(folder_, "a").value();
  for (const char* damage : {"", "{", "[]", R"({"scan": 3, "created": "x"})", R"({"scan": "../x", "created": "x"})"}) {
    for (const auto& entry : fs::directory_iterator(folder_ / "unfinished")) {
      ASSERT_TRUE(write_file(entry.path(), damage));
    }
    const UnfinishedScan next = begin_scan(folder_, "a").value();
    EXPECT_FALSE(next.resumed);
    EXPECT_NE(next.id, first.id);
  }
}

TEST_F(Unfinished, AFolderThatCannotBeMadeIsAnError) {
  ASSERT_TRUE(write_file(folder_, "a file"));
  EXPECT_FALSE(begin_scan(folder_, "a"));
}

}  // namespace
}  // namespace gyre
