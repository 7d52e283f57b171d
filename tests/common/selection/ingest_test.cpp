// SPDX-License-Identifier: Apache-2.0
#include "common/selection/ingest.h"

#include "common/bundle/atomic_file.h"
#include "common/bundle/ulid.h"

#include <gtest/gtest.h>
#include <unistd.h>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace gyre {
namespace {

namespace fs = std::filesystem;

class Ingest : public testing::Test {
 protected:
  void SetUp() override {
    const std::string name = testing::UnitTest::GetInstance()->current_test_info()->name();
    root_ = fs::temp_directory_path() / ("gyre-ingest-" + name + "-" + std::to_string(::getpid()));
    fs::remove_all(root_);
    fs::create_directories(capture());
    scan_.id = new_ulid();
    bundle_ = create_bundle(root_ / "scan", scan_).value();
  }
  void TearDown() override { fs::remove_all(root_); }

  fs::path capture() const { return root_ / "capture"; }

  // Pictures of a texture that moves on by two pixels each time.
  void write_pictures(int count, const char* extension) const {
    cv::Mat noise(96, 128 + 2 * count, CV_8UC3);
    cv::RNG random(3);
    random.fill(noise, cv::RNG::UNIFORM, 0, 255);
    cv::GaussianBlur(noise, noise, {}, 2.0);
    for (int i = 0; i < count; ++i) {
      const fs::path file = capture() / (std::to_string(i) + extension);
      ASSERT_TRUE(cv::imwrite(file.string(), noise(cv::Rect(2 * i, 0, 128, 96))));
    }
  }

  Result<IngestedPass> ingest() const {
    return ingest_capture(
        capture(), "body", bundle_, SelectionOptions::for_pass("body"), [](double, std::string_view) {}, cancel_);
  }

  // Writes what the caller of ingest_capture writes, and verifies the whole.
  void finish(const IngestedPass& pass) {
    scan_.passes = {pass.pass};
    ASSERT_TRUE(write_scan(bundle_, scan_));
    ASSERT_TRUE(write_frame_log(bundle_, pass.records));
    const Result<void> verified = verify_bundle(bundle_);
    EXPECT_TRUE(verified) << verified.error().message();
  }

  fs::path root_;
  Scan scan_;
  std::atomic<bool> cancel_{false};
  Bundle bundle_{""};
};

TEST_F(Ingest, PhotographsAreAllKeptByteForByte) {
  write_pictures(12, ".jpg");
  const Result<IngestedPass> pass = ingest();
  ASSERT_TRUE(pass) << pass.error().message();
  EXPECT_EQ(pass->keyframes, 12);
  EXPECT_EQ(pass->pass.frame_count, 12);
  EXPECT_EQ(pass->pass.width, 128);
  EXPECT_EQ(pass->pass.fps, 0.0);
  for (int i = 0; i < 12; ++i) {
    EXPECT_EQ(read_file(bundle_.frame("body", i)).value(), read_file(capture() / (std::to_string(i) + ".jpg")).value());
  }
  finish(*pass);
}

TEST_F(Ingest, ManyPicturesAreSelectedFrom) {
  write_pictures(180, ".jpg");
  const Result<IngestedPass> pass = ingest();
  ASSERT_TRUE(pass) << pass.error().message();
  EXPECT_GE(pass->keyframes, 59);
  EXPECT_LE(pass->keyframes, 60);
  EXPECT_EQ(pass->records.size(), 180U);
  finish(*pass);
}

TEST_F(Ingest, PngBecomesJpeg) {
  write_pictures(8, ".png");
  const Result<IngestedPass> pass = ingest();
  ASSERT_TRUE(pass) << pass.error().message();
  const cv::Mat stored = cv::imread((capture() / "3.png").string());
  const cv::Mat keyframe = cv::imread(bundle_.frame("body", 3).string());
  EXPECT_LT(cv::norm(stored, keyframe, cv::NORM_L1) / static_cast<double>(stored.total() * 3), 3.0);
  finish(*pass);
}

TEST_F(Ingest, ErrorsNameTheCapture) {
  write_pictures(5, ".jpg");
  const Result<IngestedPass> few = ingest();
  ASSERT_FALSE(few);
  EXPECT_NE(few.error().message().find("too few frames"), std::string::npos);
  EXPECT_NE(few.error().message().find("capture"), std::string::npos);
}

TEST_F(Ingest, RecordsCountMotionTowardsTheNextFrame) {
  const std::vector<MeasuredFrame> frames = {{0.0, {0.0, 1.0}}, {0.1, {3.0, 2.0}}, {0.2, {5.0, 3.0}}};
  Selection selection;
  selection.smoothed = {0.0, 3.5, 4.5};
  selection.decisions.resize(3);
  selection.decisions[0].keyframe = true;
  selection.decisions[2].keyframe = true;
  const std::vector<FrameRecord> records = frame_records("body", frames, selection);
  EXPECT_EQ(records[0].motion, 3.0);
  EXPECT_EQ(records[1].motion, 5.0);
  EXPECT_EQ(records[2].motion, 5.0) << "the last repeats the one before";
  EXPECT_EQ(records[0].smoothed_motion, 3.5);
  EXPECT_EQ(records[2].sharpness, 3.0);
  EXPECT_EQ(records[1].decision, "skipped");
  EXPECT_EQ(records[2].decision, "keyframe");
}

}  // namespace
}  // namespace gyre
