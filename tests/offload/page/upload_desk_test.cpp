// SPDX-License-Identifier: Apache-2.0
#include "offload/page/upload_desk.h"

#include "common/bundle/atomic_file.h"
#include "common/bundle/ulid.h"
#include "tests/temporary_folder.h"

#include <gtest/gtest.h>
#include <limits>

namespace gyre {
namespace {

namespace fs = std::filesystem;

UploadDesk::Reader reader_of(std::string bytes, bool whole = true) {
  return [bytes = std::move(bytes), whole](const std::function<bool(std::string_view)>& take) {
    for (std::size_t i = 0; i < bytes.size(); i += 7) {
      if (!take(std::string_view(bytes).substr(i, 7))) return false;
    }
    return whole;
  };
}

class UploadDeskTest : public ::testing::Test {
 protected:
  std::string begin() { return desk_.begin(10).value(); }

  TemporaryFolder folder_;
  UploadDesk desk_{folder_.path() / "uploads", 0};
};

TEST_F(UploadDeskTest, KeepsWhatWasSent) {
  const std::string id = begin();
  ASSERT_TRUE(desk_.take(id, "body", "mp4", reader_of("the body's recording")));
  ASSERT_TRUE(desk_.take(id, "head", "mov", reader_of("first")));
  ASSERT_TRUE(desk_.take(id, "head", "mp4", reader_of("the head's recording")));
  EXPECT_TRUE(desk_.finished(false).empty());
  ASSERT_TRUE(desk_.finish(id, 1700.0));
  const std::vector<Upload> uploads = desk_.finished(false);
  ASSERT_EQ(uploads.size(), 1U);
  EXPECT_EQ(uploads[0].id, id);
  EXPECT_EQ(uploads[0].height_mm, 1700.0);
  ASSERT_EQ(uploads[0].recordings.size(), 2U);
  EXPECT_EQ(uploads[0].recordings[0].pass, "body");
  EXPECT_EQ(read_file(uploads[0].recordings[0].capture).value(), "the body's recording");
  EXPECT_EQ(uploads[0].recordings[1].capture.filename(), "head.mp4");
  EXPECT_EQ(read_file(uploads[0].recordings[1].capture).value(), "the head's recording");
  EXPECT_FALSE(desk_.take(id, "head", "mp4", reader_of("late")));
}

TEST_F(UploadDeskTest, KeepsNothingOfWhatDidNotComeWhole) {
  const std::string id = begin();
  EXPECT_FALSE(desk_.take(id, "body", "mp4", reader_of("half a rec", false)));
  EXPECT_TRUE(fs::is_empty(desk_.folder_of(id)));
  EXPECT_FALSE(desk_.finish(id, {}));
}

TEST_F(UploadDeskTest, RefusesNamesThatLeadElsewhere) {
  const std::string id = begin();
  EXPECT_FALSE(desk_.take(id, "../body", "mp4", reader_of("x")));
  EXPECT_FALSE(desk_.take(id, "body", "../mp4", reader_of("x")));
  EXPECT_FALSE(desk_.take(id, "body", "", reader_of("x")));
  EXPECT_FALSE(desk_.take("..", "body", "mp4", reader_of("x")));
  EXPECT_FALSE(desk_.take(new_ulid(), "body", "mp4", reader_of("x")));
  EXPECT_FALSE(desk_.finish("../uploads", {}));
  desk_.remove("../uploads");
  EXPECT_TRUE(fs::exists(desk_.folder_of(id)));
}

TEST_F(UploadDeskTest, AfterARestartGoesOnWithFinishedUploadsAlone) {
  const std::string finished = begin();
  ASSERT_TRUE(desk_.take(finished, "turn", "mp4", reader_of("x")));
  ASSERT_TRUE(desk_.finish(finished, {}));
  const std::string other = begin();
  ASSERT_TRUE(desk_.take(other, "body", "mp4", reader_of("x")));
  const UploadDesk again(folder_.path() / "uploads", 0);
  const std::vector<Upload> uploads = again.finished(true);
  ASSERT_EQ(uploads.size(), 1U);
  EXPECT_EQ(uploads[0].id, finished);
  EXPECT_FALSE(uploads[0].height_mm);
  EXPECT_FALSE(fs::exists(desk_.folder_of(other)));
}

TEST_F(UploadDeskTest, SaysWhenThereIsNoRoom) {
  EXPECT_FALSE(desk_.begin(std::numeric_limits<std::uint64_t>::max()));
  UploadDesk careful(folder_.path() / "uploads", std::numeric_limits<std::uint64_t>::max());
  const Result<std::string> begun = careful.begin(1);
  ASSERT_FALSE(begun);
  EXPECT_NE(begun.error().message().find("room"), std::string::npos);
}

}  // namespace
}  // namespace gyre
