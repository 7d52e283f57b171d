// SPDX-License-Identifier: Apache-2.0
#include "offload/pipeline/pipeline.h"
#include "common/bundle/atomic_file.h"
#include "tests/offload/pipeline/text_stages.h"

#include <gtest/gtest.h>
#include <unistd.h>

namespace gyre {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class PipelineTest : public testing::Test {
 protected:
  void SetUp() override {
    root_ = fs::path(testing::TempDir()) / ("pipeline-" + std::to_string(::getpid()) + "-" +
                                            testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(root_);
    set_text("ab");
  }
  void TearDown() override { fs::remove_all(root_); }

  void set_text(const std::string& text) { ASSERT_TRUE(write_file(root_ / "scan.json", text)); }
  tl::expected<std::vector<StageReport>, PipelineFailure> run(const PipelineOptions& options = {}) {
    return run_pipeline(
        text_stages(), Bundle(root_), options,
        [&](const std::string& stage, double f, std::string_view what) {
          said_ += stage + " " + std::to_string(f) + " " + std::string(what) + "\n";
        },
        [this] { return order_; });
  }
  std::string avatar() const { return read_file(root_ / "avatar.glb").value_or("none"); }
  static std::vector<bool> resumed(const std::vector<StageReport>& reports) {
    std::vector<bool> flags;
    for (const StageReport& r : reports) flags.push_back(r.resumed);
    return flags;
  }

  fs::path root_;
  std::string said_;
  Order order_ = Order::go_on;
};

TEST_F(PipelineTest, RunsAllStagesAndPublishes) {
  const auto reports = run();
  ASSERT_TRUE(reports) << reports.error().message();
  EXPECT_EQ(avatar(), "abab!");
  EXPECT_NE(said_.find("half way"), std::string::npos);
  const json record = json::parse(*read_file(root_ / "work/double/stage.json"));
  EXPECT_EQ(record.at("result").at("length"), 4);
  EXPECT_GT(record.at("peak_memory_mib").get<double>(), 0);
}

TEST_F(PipelineTest, NothingRunsTwice) {
  ASSERT_TRUE(run());
  EXPECT_EQ(resumed(*run()), (std::vector<bool>{true, true}));
}

TEST_F(PipelineTest, AChangedInputRunsEverythingAfterIt) {
  ASSERT_TRUE(run());
  set_text("c");
  EXPECT_EQ(resumed(*run()), (std::vector<bool>{false, false}));
  EXPECT_EQ(avatar(), "cc!");
}

TEST_F(PipelineTest, AChangedOptionRunsItsStage) {
  ASSERT_TRUE(run());
  PipelineOptions options;
  options.stage_options = {{"shout", {{"marks", 3}}}};
  EXPECT_EQ(resumed(*run(options)), (std::vector<bool>{true, false}));
  EXPECT_EQ(avatar(), "abab!!!");
}

TEST_F(PipelineTest, AnOptionThatNamesAFileCountsItsContent) {
  ASSERT_TRUE(write_file(root_ / "extra", "1"));
  PipelineOptions options;
  options.stage_options = {{"shout", {{"extra", (root_ / "extra").string()}}}};
  ASSERT_TRUE(run(options));
  EXPECT_EQ(resumed(*run(options)), (std::vector<bool>{true, true}));
  ASSERT_TRUE(write_file(root_ / "extra", "2"));
  EXPECT_EQ(resumed(*run(options)), (std::vector<bool>{true, false}));
}

TEST_F(PipelineTest, ADeletedProductIsPublishedAgain) {
  ASSERT_TRUE(run());
  fs::remove(root_ / "avatar.glb");
  EXPECT_EQ(resumed(*run()), (std::vector<bool>{true, true}));
  EXPECT_EQ(avatar(), "abab!");
}

TEST_F(PipelineTest, StopsAtUntil) {
  PipelineOptions options;
  options.until = "double";
  EXPECT_EQ(run(options)->size(), 1U);
  EXPECT_EQ(avatar(), "none");
  options.until = "dance";
  EXPECT_EQ(run(options).error().exit_code(), 2);
  options = {};
  options.stage_options = {{"shout", {{"volume", 3}}}};
  EXPECT_EQ(run(options).error().exit_code(), 2);
}

TEST_F(PipelineTest, FailuresOfAStageComeBackWhole) {
  set_text("refuse");
  EXPECT_EQ(run().error().message(), "refused text: scan.json; write something else");
  EXPECT_EQ(run().error().exit_code(), 2);
  set_text("throw");
  EXPECT_NE(run().error().message().find("thrown text"), std::string::npos);
  set_text("crash");
  EXPECT_NE(run().error().message().find("signal"), std::string::npos);
  EXPECT_FALSE(fs::exists(root_ / "work/double"));
}

TEST_F(PipelineTest, ACrashLeavesTheLastWordsInTheBundleUntilTheStageSucceeds) {
  set_text("crash");
  const auto failed = run();
  EXPECT_EQ(failed.error().cause, FailureCause::crash);
  EXPECT_EQ(failed.error().stage, "double");
  EXPECT_NE(failed.error().log.find("the last words"), std::string::npos);
  const std::string log = read_file(root_ / "work/double.log").value();
  EXPECT_NE(log.find("the last words"), std::string::npos);
  EXPECT_NE(log.find("signal"), std::string::npos);
  set_text("memory");
  EXPECT_EQ(run().error().cause, FailureCause::memory);
  set_text("refuse");
  EXPECT_EQ(run().error().cause, FailureCause::stage);
  set_text("ab");
  ASSERT_TRUE(run());
  EXPECT_FALSE(fs::exists(root_ / "work/double.log"));
}

TEST_F(PipelineTest, CancelKillsTheStage) {
  set_text("forever");
  order_ = Order::cancel;
  EXPECT_EQ(run().error().cause, FailureCause::cancelled);
  EXPECT_FALSE(fs::exists(root_ / "work/double.log"));
}

// Whatever half-written folder a killed run left behind, the next run ends with the same avatar.
TEST_F(PipelineTest, LeftoversOfAKilledRunDoNotMatter) {
  fs::create_directories(root_ / "work/.double.part");
  ASSERT_TRUE(write_file(root_ / "work/.double.part/text", "half"));
  fs::create_directories(root_ / "work/double");
  ASSERT_TRUE(write_file(root_ / "work/double/text", "no record"));
  ASSERT_TRUE(run());
  EXPECT_EQ(avatar(), "abab!");
}

}  // namespace
}  // namespace gyre
