// SPDX-License-Identifier: Apache-2.0
#include "common/bundle/bundle.h"
#include "common/bundle/atomic_file.h"
#include "common/bundle/sha256.h"
#include "common/bundle/ulid.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <csignal>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

namespace gyre {
namespace {

namespace fs = std::filesystem;

class BundleTest : public testing::Test {
 protected:
  void SetUp() override {
    root_ = fs::path(testing::TempDir()) / ("bundle-" + std::to_string(::getpid()) + "-" +
                                            testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(root_);
  }
  void TearDown() override { fs::remove_all(root_); }

  static Scan some_scan() {
    Scan scan;
    scan.id = new_ulid();
    scan.device = "rig <1>";
    scan.height_mm = 1660.5;
    scan.camera = Camera{.width = 8, .height = 16, .fx = 10, .fy = 11, .cx = 4, .cy = 8, .k1 = 0.1};
    scan.passes = {{"body", 15.0, 300, 8, 16}, {"head", 15.0, 150, 8, 16, 26.0}};
    return scan;
  }
  void put_frame(const Bundle& bundle, const std::string& pass, int index, cv::Size size = {8, 16}) {
    cv::imwrite(bundle.frame(pass, index).string(), cv::Mat(size, CV_8UC3, cv::Scalar(1, 2, 3)));
  }

  fs::path root_;
};

TEST_F(BundleTest, ScanRoundTrip) {
  const Scan scan = some_scan();
  const Result<Bundle> bundle = create_bundle(root_ / "scan", scan);
  ASSERT_TRUE(bundle) << bundle.error().message();
  const Result<Scan> read = read_scan(*bundle);
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_EQ(to_json(*read), to_json(scan));
  EXPECT_FALSE(read->passes[0].focal_35mm);
  EXPECT_EQ(read->passes[1].focal_35mm, 26.0);
}

TEST_F(BundleTest, FrameLogRoundTrip) {
  const Bundle bundle = *create_bundle(root_, some_scan());
  std::vector<FrameRecord> records(2);
  records[0] = {.pass = "body",
                .index = 0,
                .time = 0.5,
                .motion = 1.25,
                .smoothed_motion = 1.0,
                .sharpness = 30,
                .exposure_s = 0.01,
                .decision = "keyframe",
                .reason = "\"quoted\"\n"};
  records[1] = {.pass = "body", .index = 1, .decision = "skipped", .reason = "between"};
  ASSERT_TRUE(write_frame_log(bundle, records));
  const auto read = read_frame_log(bundle);
  ASSERT_TRUE(read) << read.error().message();
  ASSERT_EQ(read->size(), 2U);
  EXPECT_EQ(to_json((*read)[0]), to_json(records[0]));
  EXPECT_FALSE((*read)[1].exposure_s.has_value());
}

TEST_F(BundleTest, DamagedJsonIsAnErrorThatNamesTheLine) {
  const Bundle bundle = *create_bundle(root_, some_scan());
  ASSERT_TRUE(write_file(bundle.frame_log(),
                         to_json(FrameRecord{.pass = "body", .decision = "skipped"}).dump() + "\n{\"pass\": 7}\n"));
  const auto read = read_frame_log(bundle);
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().where.find(":2"), std::string::npos);
  for (const char* text : {"", "{", "[]", "{\"format\":1}", "{\"format\":99,\"id\":\"x\"}",
                           "{\"format\":1,\"id\":\"../../etc\",\"mode\":\"orbit\",\"passes\":[]}"}) {
    ASSERT_TRUE(write_file(bundle.scan_file(), text));
    EXPECT_FALSE(read_scan(bundle)) << text;
  }
}

TEST_F(BundleTest, FramesAreListedInThePassesOrder) {
  Scan scan = some_scan();
  scan.passes = {{"turn"}, {"body"}};
  const Bundle bundle = *create_bundle(root_, scan);
  put_frame(bundle, "body", 3);
  put_frame(bundle, "turn", 12);
  put_frame(bundle, "turn", 2);
  const auto frames = list_frames(bundle);
  ASSERT_TRUE(frames);
  EXPECT_EQ(*frames, (std::vector<FrameId>{{"turn", 2}, {"turn", 12}, {"body", 3}}));
}

TEST_F(BundleTest, VerifyNamesWhatIsWrong) {
  const Bundle bundle = *create_bundle(root_, some_scan());
  ASSERT_TRUE(write_frame_log(bundle, {{.pass = "body", .index = 1, .decision = "keyframe"}}));
  EXPECT_NE(verify_bundle(bundle).error().message().find("body-000001.jpg"), std::string::npos);
  put_frame(bundle, "body", 1);
  EXPECT_TRUE(verify_bundle(bundle));
  put_frame(bundle, "body", 2, {16, 16});
  EXPECT_NE(verify_bundle(bundle).error().message().find("differ in size"), std::string::npos);
  fs::remove(bundle.frame("body", 2));
  ASSERT_TRUE(write_file(bundle.frames() / "body-000005.jpg", "not a picture"));
  EXPECT_NE(verify_bundle(bundle).error().message().find("cannot be decoded"), std::string::npos);
  fs::remove(bundle.frame("body", 5));
  ASSERT_TRUE(write_file(bundle.frames() / "notes.txt", "hello"));
  EXPECT_NE(verify_bundle(bundle).error().message().find("foreign"), std::string::npos);
}

TEST(FrameName, ParsesOnlyItsOwnForm) {
  EXPECT_EQ(parse_frame_name(frame_name("head", 42)), (FrameId{"head", 42}));
  EXPECT_EQ(parse_frame_name("a-b-000001.jpg"), (FrameId{"a-b", 1}));
  for (const char* name :
       {"", "body.jpg", "body-1.jpg", "-000001.jpg", "body-00000x.jpg", "../x-000001.jpg", "body-000001.png"}) {
    EXPECT_FALSE(parse_frame_name(name).has_value()) << name;
  }
}

TEST(SafeName, RefusesPathTricks) {
  EXPECT_TRUE(is_safe_name("body-000001.jpg"));
  for (const char* name : {"", ".", "..", "../x", "a/b", "/etc/passwd", ".hidden", "a\\b", "a b", "a\n"})
    EXPECT_FALSE(is_safe_name(name)) << name;
  EXPECT_FALSE(is_safe_name(std::string_view("a\0b", 3)));
  EXPECT_FALSE(is_safe_name(std::string(300, 'a')));
}

TEST(Ulid, IsWellFormedAndNeverRepeats) {
  std::set<std::string> seen;
  for (int i = 0; i < 1000; ++i) {
    const std::string id = new_ulid();
    EXPECT_TRUE(is_ulid(id));
    EXPECT_TRUE(seen.insert(id).second);
  }
  EXPECT_FALSE(is_ulid("01ARZ3NDEKTSV4RRFFQ69G5FAU"));  // U is not in the alphabet
  EXPECT_FALSE(is_ulid("81ARZ3NDEKTSV4RRFFQ69G5FAV"));  // beyond 48 bits
  EXPECT_FALSE(is_ulid("../../../../../../../../../"));
}

TEST(Sha256, KnownAnswer) {
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST_F(BundleTest, FolderHashSeesNamesAndContentButNotTheException) {
  ASSERT_TRUE(write_file(root_ / "a", "1"));
  const std::string before = *sha256_of_folder(root_, "stage.json");
  ASSERT_TRUE(write_file(root_ / "stage.json", "seconds"));
  EXPECT_EQ(*sha256_of_folder(root_, "stage.json"), before);
  fs::rename(root_ / "a", root_ / "b");
  EXPECT_NE(*sha256_of_folder(root_, "stage.json"), before);
}

// A disk that fills up (here: a file size limit) leaves the old content and no temporary file, and the error says so.
TEST_F(BundleTest, FullDiskKeepsTheOldFile) {
  const fs::path file = root_ / "scan.json";
  ASSERT_TRUE(write_file(file, "old"));
  const pid_t child = ::fork();
  if (child == 0) {
    ::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{1000, 1000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    const Result<void> written = write_file(file, std::string(100000, 'x'));
    ::_exit(written ? 1 : 0);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  EXPECT_EQ(*read_file(file), "old");
  EXPECT_EQ(std::distance(fs::directory_iterator(root_), fs::directory_iterator()), 1);
}

TEST_F(BundleTest, WritingIntoAMissingFolderIsAnError) {
  const Result<void> written = write_file(root_ / "missing" / "x", "y");
  ASSERT_FALSE(written);
  EXPECT_NE(written.error().message().find("missing"), std::string::npos);
}

}  // namespace
}  // namespace gyre
