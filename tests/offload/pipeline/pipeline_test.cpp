// SPDX-License-Identifier: Apache-2.0
#include "offload/pipeline/pipeline.h"
#include "common/bundle/atomic_file.h"
#include "offload/pipeline/stage_process.h"

#include <gtest/gtest.h>
#include <unistd.h>
#include <csignal>

namespace gyre {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// A pipeline of two stages over text files: `double` writes its input twice, `shout` appends exclamation marks.
std::vector<Stage> text_stages() {
  Stage doubled;
  doubled.name = "double";
  doubled.inputs = {"scan.json"};
  doubled.run = [](const StageContext& c) -> Result<json> {
    const std::string text = *read_file(c.bundle.scan_file());
    if (text == "crash") ::raise(SIGSEGV);
    if (text == "throw") throw std::runtime_error("thrown text");
    if (text == "refuse") return wrong_use("refused text", "scan.json", "write something else");
    if (text == "forever") ::pause();
    c.progress(0.5, "half way");
    if (Result<void> w = write_file(c.out / "text", text + text); !w) return tl::unexpected(w.error());
    return json{{"length", 2 * text.size()}};
  };
  Stage shout;
  shout.name = "shout";
  shout.inputs = {"work/double"};
  shout.external = {"extra"};
  shout.options = {{"marks", 1}, {"extra", ""}};
  shout.published = {"avatar.glb"};
  shout.run = [](const StageContext& c) -> Result<json> {
    const std::string text =
        *read_file(c.bundle.work("double") / "text") + std::string(c.options.at("marks").get<std::size_t>(), '!');
    if (Result<void> w = write_file(c.out / "avatar.glb", text); !w) return tl::unexpected(w.error());
    return json::object();
  };
  return {doubled, shout};
}

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
  Result<std::vector<StageReport>> run(const PipelineOptions& options = {}) {
    return run_pipeline(
        text_stages(), Bundle(root_), options,
        [&](const std::string& stage, double f, std::string_view what) {
          said_ += stage + " " + std::to_string(f) + " " + std::string(what) + "\n";
        },
        cancel_);
  }
  std::string avatar() const { return read_file(root_ / "avatar.glb").value_or("none"); }
  static std::vector<bool> resumed(const std::vector<StageReport>& reports) {
    std::vector<bool> flags;
    for (const StageReport& r : reports) flags.push_back(r.resumed);
    return flags;
  }

  fs::path root_;
  std::string said_;
  std::atomic<bool> cancel_{false};
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

TEST_F(PipelineTest, CancelKillsTheStage) {
  set_text("forever");
  cancel_ = true;
  EXPECT_EQ(run().error().what, "cancelled");
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

// The runner starts this same executable as a stage's worker.
int main(int argc, char** argv) {
  if (argc > 6 && std::string(argv[1]) == "stage") {
    for (const gyre::Stage& stage : gyre::text_stages()) {
      if (stage.name != argv[2]) continue;
      gyre::StageContext context{gyre::Bundle(argv[3]), argv[5], nlohmann::json::parse(argv[7])};
      return gyre::run_stage_worker(stage, std::move(context));
    }
    return 2;
  }
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
