// SPDX-License-Identifier: Apache-2.0
// The Slurm executor against programs that answer as Slurm's do; the system tests have the real one.
#include "offload/pipeline/slurm_executor.h"

#include "common/bundle/atomic_file.h"
#include "offload/pipeline/command.h"
#include "offload/pipeline/slurm.h"
#include "tests/device/spool/scan_support.h"
#include "tests/offload/pipeline/text_stages.h"

#include <gtest/gtest.h>
#include <cstdlib>

namespace gyre {
namespace {

namespace fs = std::filesystem;

// A queue is a folder; of each job it holds id.name, id.state and, while it runs, id.pid.
constexpr const char* sbatch_script = R"sh(#!/bin/bash
q=$(dirname "$0")/queue
set_state() { echo "$1" >"$q/$id.$BASHPID" && mv "$q/$id.$BASHPID" "$q/$id.state"; }
id=$(($(ls "$q" | grep -c '[.]name$') + 100))
for word in "$@"; do
  case $word in
    --job-name=*) echo "${word#*=}" >"$q/$id.name" ;;
    --output=*) out=${word#*=} ;;
    --error=*) err=${word#*=} ;;
    --dependency=afterok:*) after=${word##*:} ;;
    --mem=*|--time=*|--cpus-per-task=*) echo "$word" >>"$q/$id.asked" ;;
  esac
  command=$word
done
set_state PENDING
(
  while [ -n "$after" ] && grep -qE 'PENDING|RUNNING' "$q/$after.state"; do sleep 0.02; done
  if [ -n "$after" ] && ! grep -q COMPLETED "$q/$after.state"; then set_state CANCELLED; exit; fi
  grep -q PENDING "$q/$id.state" || exit
  set_state RUNNING
  setsid bash -c "$command" >"$out" 2>"$err" &
  echo $! >"$q/$id.pid"
  if wait $!; then s=COMPLETED; else s=FAILED; fi
  grep -q RUNNING "$q/$id.state" && set_state $s
) >/dev/null 2>&1 &
echo $id
)sh";
constexpr const char* squeue_script = R"sh(#!/bin/bash
cd "$(dirname "$0")/queue"
for s in *.state; do
  [ -e "$s" ] && grep -qE 'PENDING|RUNNING' "$s" && echo "${s%.state} $(cat "${s%.state}.name")"
done
exit 0
)sh";
constexpr const char* sinfo_script = R"sh(#!/bin/bash
echo "4 2000"
echo "6 1000"
)sh";
constexpr const char* scontrol_script = R"sh(#!/bin/bash
q=$(dirname "$0")/queue
echo "JobId=$4 JobName=$(cat "$q/$4.name") JobState=$(cat "$q/$4.state") Reason=None"
)sh";
constexpr const char* scancel_script = R"sh(#!/bin/bash
q=$(dirname "$0")/queue
set_state() { echo "$1" >"$q/$id.$BASHPID" && mv "$q/$id.$BASHPID" "$q/$id.state"; }
for id in "$@"; do
  [ -e "$q/$id.state" ] && grep -qE 'PENDING|RUNNING' "$q/$id.state" || continue
  set_state CANCELLED
  [ -e "$q/$id.pid" ] && kill -KILL -- "-$(cat "$q/$id.pid")"
done
exit 0
)sh";

class SlurmExecutorTest : public testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(bin_ / "queue");
    fs::create_directories(bundle_.root() / "work");
    for (const auto& [name, text] : std::map<std::string, std::string>{{"sbatch", sbatch_script},
                                                                       {"squeue", squeue_script},
                                                                       {"sinfo", sinfo_script},
                                                                       {"scontrol", scontrol_script},
                                                                       {"scancel", scancel_script}}) {
      ASSERT_TRUE(write_file(bin_ / name, text));
      fs::permissions(bin_ / name, fs::perms::owner_all);
    }
    path_ = std::getenv("PATH");
    ::setenv("PATH", (bin_.string() + ":" + path_).c_str(), 1);
  }
  void TearDown() override { ::setenv("PATH", path_.c_str(), 1); }

  ScanOutcome run(
      const std::string& text, const Ask& ask = [] { return Order::go_on; }) {
    EXPECT_TRUE(write_file(bundle_.scan_file(), text));
    return resume(ask);
  }
  ScanOutcome resume(const Ask& ask = [] { return Order::go_on; }) {
    SlurmOptions options;
    options.poll = std::chrono::milliseconds(20);
    PipelineOptions pipeline;
    pipeline.stage_options = {{"shout", {{"marks", 2}}}};
    return SlurmExecutor(options).run(
        text_stages(), {"SCAN", bundle_, pipeline},
        [this](const std::string& stage, double, std::string_view what) {
          said_ += stage + " " + std::string(what) + "\n";
        },
        ask);
  }
  // Ends the run as `order` once a job runs.
  Ask once_running(Order order) {
    return [this, order] {
      for (const auto& entry : fs::directory_iterator(bin_ / "queue")) {
        if (entry.path().extension() == ".pid") return order;
      }
      return Order::go_on;
    };
  }
  std::string state(int job) const { return read_file(bin_ / "queue" / (std::to_string(job) + ".state")).value_or(""); }

  TemporaryFolder folder_;
  fs::path bin_ = folder_.path() / "bin";
  Bundle bundle_{folder_.path() / "it's a scan"};
  std::string path_, said_;
};

TEST_F(SlurmExecutorTest, StagesRunOneAfterTheOtherAndSayHowFarTheyAre) {
  const ScanOutcome outcome = run("ab");
  ASSERT_TRUE(outcome) << outcome.error().message();
  ASSERT_EQ(outcome->size(), 2U);
  EXPECT_EQ(outcome->at(0).name, "double");
  EXPECT_GT(outcome->at(0).peak_memory_mib, 0.0);
  EXPECT_EQ(read_file(bundle_.root() / "avatar.glb").value(), "abab!!");
  EXPECT_NE(said_.find("half way"), std::string::npos);
  const std::string asked = read_file(bin_ / "queue" / "100.asked").value();
  EXPECT_NE(asked.find("--mem=1280"), std::string::npos) << asked;
  EXPECT_NE(asked.find("--cpus-per-task=6"), std::string::npos) << asked;
  // Again, when the queue has seen the last job's end: nothing has changed.
  while (state(101) != "COMPLETED\n") std::this_thread::yield();
  EXPECT_TRUE(resume()->at(1).resumed);
}

TEST_F(SlurmExecutorTest, AFailureComesBackWithItsCauseAndItsLogAndTheRestIsTakenBack) {
  ScanOutcome outcome = run("refuse");
  ASSERT_FALSE(outcome);
  EXPECT_EQ(outcome.error().message(), "refused text: scan.json; write something else");
  EXPECT_EQ(outcome.error().cause, FailureCause::stage);
  EXPECT_EQ(state(101), "CANCELLED\n");
  outcome = run("crash");
  ASSERT_FALSE(outcome);
  EXPECT_EQ(outcome.error().cause, FailureCause::crash);
  EXPECT_NE(outcome.error().log.find("the last words"), std::string::npos);
}

TEST_F(SlurmExecutorTest, ACancelledScanLeavesNoJobs) {
  const ScanOutcome outcome = run("forever", once_running(Order::cancel));
  ASSERT_FALSE(outcome);
  EXPECT_EQ(outcome.error().cause, FailureCause::cancelled);
  EXPECT_EQ(state(100), "CANCELLED\n");
  EXPECT_TRUE(jobs_in_queue("gyre-SCAN-")->empty());
}

TEST_F(SlurmExecutorTest, AJobThatEndsWithoutAWordIsNotLostSightOf) {
  std::atomic<bool> killed{false};
  const ScanOutcome outcome = run("forever", [&] {
    if (once_running(Order::cancel)() == Order::cancel && !killed.exchange(true)) {
      EXPECT_TRUE(cancel_jobs({"100"}));  // by somebody else
      EXPECT_TRUE(write_file(bin_ / "queue" / "100.state", std::string_view("NODE_FAIL\n")));
    }
    return Order::go_on;
  });
  ASSERT_FALSE(outcome);
  EXPECT_EQ(outcome.error().cause, FailureCause::lost) << outcome.error().message();
  EXPECT_NE(read_file(log_of_stage(bundle_, "double")).value().find("NODE_FAIL"), std::string::npos);
}

TEST_F(SlurmExecutorTest, AJobThatSlurmHasForgottenIsLookedUpWhereThereIsAccounting) {
  const auto program = [&](const std::string& name, std::string_view text) {
    ASSERT_TRUE(write_file(bin_ / name, text));
    fs::permissions(bin_ / name, fs::perms::owner_all);
  };
  program("scontrol", "#!/bin/bash\necho 'slurm_load_jobs error: Invalid job id specified' >&2\nexit 1\n");
  program("sacct", "#!/bin/bash\necho 'sacct: error: Slurm accounting storage is disabled' >&2\nexit 1\n");
  EXPECT_EQ(end_state("100"), "");
  program("sacct", "#!/bin/bash\necho \"CANCELLED by 1000 $*\"\n");
  EXPECT_EQ(end_state("100"), "CANCELLED");
  program("sacct", "#!/bin/bash\n[[ \" $* \" == *' --jobs=100 '* ]] && echo OUT_OF_MEMORY\n");
  std::atomic<bool> killed{false};
  const ScanOutcome outcome = run("forever", [&] {
    if (once_running(Order::cancel)() == Order::cancel && !killed.exchange(true)) {
      EXPECT_TRUE(cancel_jobs({"100"}));
    }
    return Order::go_on;
  });
  ASSERT_FALSE(outcome);
  EXPECT_EQ(outcome.error().cause, FailureCause::memory) << outcome.error().message();
}

TEST_F(SlurmExecutorTest, JobsThatOutliveTheHostAreFoundAgain) {
  ASSERT_FALSE(run("wait", once_running(Order::pause)));
  EXPECT_EQ(jobs_in_queue("gyre-SCAN-")->size(), 2U);
  ASSERT_TRUE(write_file(bundle_.root() / "go", std::string_view("")));
  const ScanOutcome outcome = resume();
  ASSERT_TRUE(outcome) << outcome.error().message();
  EXPECT_EQ(read_file(bundle_.root() / "avatar.glb").value(), "waitwait!!");
  EXPECT_FALSE(fs::exists(bin_ / "queue" / "102.name"));  // nothing was submitted twice
}

TEST(Slurm, ReadsTheRecordOfAJob) {
  const std::string record = "JobId=7 JobName=JobState=fake JobState=TIMEOUT Reason=TimeLimit\n   ExitCode=0:15\n";
  EXPECT_EQ(field_of(record, "JobState"), "TIMEOUT");
  EXPECT_EQ(field_of(record, "ExitCode"), "0:15");
  EXPECT_EQ(field_of(record, "Nothing"), "");
}

TEST(Command, SaysWhatAProgramSaidAndKillsWhatHangs) {
  const CommandOutcome outcome = run_command({"sh", "-c", "echo out; echo err >&2; exit 3"}).value();
  EXPECT_EQ(outcome.code, 3);
  EXPECT_EQ(outcome.out, "out\n");
  EXPECT_EQ(outcome.err, "err\n");
  EXPECT_FALSE(run_command({"sleep", "100"}, std::chrono::milliseconds(50)));
  EXPECT_FALSE(run_command({"no-such-program"}));
}

}  // namespace
}  // namespace gyre
