// SPDX-License-Identifier: Apache-2.0
#include "offload/pipeline/runner.h"

#include "common/bundle/atomic_file.h"
#include "offload/pipeline/local_executor.h"
#include "tests/device/spool/scan_support.h"

#include <gtest/gtest.h>
#include <condition_variable>
#include <mutex>

namespace gyre {
namespace {

using nlohmann::json;
using std::chrono::milliseconds;

PipelineFailure failure_of(FailureCause cause) {
  PipelineFailure failure{{"it went wrong", "here", ""}};
  failure.cause = cause;
  failure.stage = "work";
  failure.log = "the last words\n";
  // A stage that finds no room gives its own reason.
  if (cause == FailureCause::space) {
    failure.cause = FailureCause::stage;
    failure.remedy = "free some disk space and try again";
  }
  return failure;
}

// Does with a scan what the test told it to, and notes how many it had at once.
class ScriptedExecutor : public Executor {
 public:
  std::vector<FailureCause> failures;  // of the first tries
  std::atomic<bool> hold{false};       // works until told to end or to go on
  std::atomic<bool> deaf{false};       // and does not ask
  std::atomic<int> asked{0};           // times it was told to go on

  ScanOutcome run(const std::vector<Stage>& stages, const ScanWork& work, const PipelineProgress& progress,
                  const Ask& ask) override {
    {
      const std::scoped_lock lock(mutex_);
      begun_.push_back(work.scan);
      options_ = work.options.stage_options;
      most_ = std::max(most_, ++now_);
    }
    progress(stages.at(0).name, 0.5, "half way");
    Order order = Order::go_on;
    for (; hold && (deaf || (order = ask()) == Order::go_on); ++asked) std::this_thread::yield();
    const std::scoped_lock lock(mutex_);
    --now_;
    if (order != Order::go_on) return tl::unexpected(failure_of(FailureCause::cancelled));
    const std::size_t tries = tries_[work.scan]++;
    if (tries < failures.size()) return tl::unexpected(failure_of(failures[tries]));
    return std::vector<StageReport>{{"work", false, 2.5, 2.0, 10.0}, {"before", true, 7.0, 7.0, 10.0}};
  }
  std::vector<std::string> begun() const {
    const std::scoped_lock lock(mutex_);
    return begun_;
  }
  int most() const {
    const std::scoped_lock lock(mutex_);
    return most_;
  }
  json options() const {
    const std::scoped_lock lock(mutex_);
    return options_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> begun_;
  std::map<std::string, std::size_t> tries_;
  json options_;
  int now_ = 0, most_ = 0;
};

class RunnerTest : public testing::Test {
 protected:
  void SetUp() override {
    store_ = Store::open(folder_.path()).value();
    options_.retry_waits = {milliseconds(1), milliseconds(1)};
  }
  std::string queue_scan(const std::string& device = "rig") {
    const Scan scan = small_scan();
    EXPECT_TRUE(store_->open_scan(scan, device, device));
    EXPECT_TRUE(store_->queue_job(scan.id));
    if (runner_) runner_->wake();
    return scan.id;
  }
  void start() {
    Stage stage;
    stage.name = "work";
    stage.options = {{"grain", 1}};
    RunnerEvents events;
    events.progress = [](const std::string&, const std::string&, double, const std::string&) {};
    events.done = [this](const std::string& scan) {
      return store_->finish_job(scan, {{"avatar.glb", 1, std::string(64, 'a')}});
    };
    events.failed = [this](const std::string& scan, const std::string& reason) {
      return store_->fail_job(scan, reason);
    };
    events.options = [](const Scan&) {
      PipelineOptions options;
      options.stage_options = {{"work", {{"grain", 5}}}};
      return Result<PipelineOptions>(options);
    };
    events.now = [this] { return wall_time_now() + milliseconds(later_ms_); };
    runner_ = std::make_unique<Runner>(options_, *store_, executor_, std::vector<Stage>{stage}, events);
    runner_->start();
  }
  bool reaches(const std::string& scan, StorePhase phase) {
    return eventually([&] {
      runner_->wake();
      return store_->scan(scan).value()->phase == phase;
    });
  }
  json failure(const std::string& scan) const {
    return json::parse(read_file(store_->bundle(scan).root() / "failure.json").value_or(""), nullptr, false);
  }

  TemporaryFolder folder_;
  RunnerOptions options_;
  ScriptedExecutor executor_;
  std::atomic<int> later_ms_{0};
  std::unique_ptr<Store> store_;
  std::unique_ptr<Runner> runner_;
};

TEST_F(RunnerTest, WorksThroughWhatWasQueuedBeforeAndAfterTheStart) {
  const std::string before = queue_scan();
  start();
  const std::string after = queue_scan();
  EXPECT_TRUE(reaches(before, StorePhase::done));
  EXPECT_TRUE(reaches(after, StorePhase::done));
  EXPECT_EQ(executor_.begun().size(), 2U);
}

TEST_F(RunnerTest, SeveralScansAtOnceAndNoMoreThanAllowed) {
  executor_.hold = true;
  std::vector<std::string> scans;
  for (int i = 0; i < 5; ++i) scans.push_back(queue_scan());
  start();
  ASSERT_TRUE(eventually([&] { return executor_.begun().size() == 2; }));
  const std::vector<ScanStatus> status = runner_->status().value();
  ASSERT_EQ(status.size(), 5U);
  EXPECT_EQ(std::count_if(status.begin(), status.end(),
                          [](const ScanStatus& s) { return s.state == StorePhase::running && s.fraction == 0.5; }),
            2);
  executor_.hold = false;
  for (const std::string& scan : scans) EXPECT_TRUE(reaches(scan, StorePhase::done));
  EXPECT_EQ(executor_.most(), 2);
}

TEST_F(RunnerTest, ACrashIsTriedAgainAndItsTracesGoWhenItSucceeds) {
  executor_.failures = {FailureCause::crash, FailureCause::lost};
  const std::string scan = queue_scan();
  start();
  EXPECT_TRUE(reaches(scan, StorePhase::done));
  EXPECT_EQ(executor_.begun().size(), 3U);
  EXPECT_EQ(store_->jobs()->at(0).tries, 3);
  EXPECT_TRUE(failure(scan).is_discarded());
}

TEST_F(RunnerTest, ACrashThatComesBackEndsAfterTheLastTryWithItsLog) {
  executor_.failures = {FailureCause::crash, FailureCause::memory, FailureCause::crash};
  const std::string scan = queue_scan();
  start();
  EXPECT_TRUE(reaches(scan, StorePhase::failed));
  EXPECT_EQ(executor_.begun().size(), 3U);
  const json report = failure(scan);
  EXPECT_EQ(report.at("tries"), 3);
  EXPECT_EQ(report.at("cause"), "crash");
  EXPECT_EQ(report.at("log"), "the last words\n");
  EXPECT_EQ(store_->scan(scan).value()->reason, "it went wrong: here");
}

TEST_F(RunnerTest, WhatTheStageSaysItselfIsNotTriedAgain) {
  executor_.failures = {FailureCause::stage};
  const std::string scan = queue_scan();
  start();
  EXPECT_TRUE(reaches(scan, StorePhase::failed));
  EXPECT_EQ(executor_.begun().size(), 1U);
}

TEST_F(RunnerTest, CountsWhatItDid) {
  executor_.failures = {FailureCause::crash};
  const std::string scan = queue_scan();
  start();
  EXPECT_TRUE(reaches(scan, StorePhase::done));
  ASSERT_TRUE(eventually([&] { return runner_->tally().finished == 1; }));
  const RunnerTally tally = runner_->tally();
  EXPECT_EQ(tally.retries, (std::map<std::string, std::uint64_t>{{"crash", 1}}));
  EXPECT_EQ(tally.failed, 0U);
  EXPECT_EQ(tally.stage_runs, (std::map<std::string, std::uint64_t>{{"work", 1}}));
  EXPECT_EQ(tally.stage_seconds, (std::map<std::string, double>{{"work", 2.5}}));
}

TEST_F(RunnerTest, AFullDiskIsWaitedForHoweverOften) {
  executor_.failures = std::vector(10, FailureCause::space);
  const std::string scan = queue_scan();
  start();
  EXPECT_TRUE(eventually([&] {
    later_ms_ += 1000;
    runner_->wake();
    return store_->scan(scan).value()->phase == StorePhase::done;
  }));
  EXPECT_EQ(runner_->tally().retries, (std::map<std::string, std::uint64_t>{{"space", 10}}));
}

TEST(RetryWait, IsBoundedAndDependsOnTheCause) {
  const RunnerOptions options;
  EXPECT_EQ(retry_wait(options, FailureCause::crash, 1), std::chrono::seconds(10));
  EXPECT_EQ(retry_wait(options, FailureCause::lost, 3), std::chrono::minutes(5));
  EXPECT_FALSE(retry_wait(options, FailureCause::memory, 4));
  EXPECT_FALSE(retry_wait(options, FailureCause::stage, 1));
  EXPECT_EQ(retry_wait(options, FailureCause::space, 1), std::chrono::seconds(10));
  EXPECT_EQ(retry_wait(options, FailureCause::space, 1000), std::chrono::minutes(5));
  EXPECT_FALSE(retry_wait(options, FailureCause::cancelled, 1));
}

TEST_F(RunnerTest, RunningAndQueuedScansAreCancelledAndRunAgainWithOtherOptions) {
  executor_.hold = true;
  options_.scans_at_once = 1;
  const std::string running = queue_scan();
  start();
  ASSERT_TRUE(eventually([&] { return executor_.begun().size() == 1; }));
  const std::string queued = queue_scan();
  ASSERT_TRUE(runner_->cancel(queued));
  ASSERT_TRUE(runner_->cancel(running));
  EXPECT_EQ(store_->scan(running).value()->phase, StorePhase::failed);
  EXPECT_EQ(store_->scan(queued).value()->phase, StorePhase::failed);
  EXPECT_EQ(store_->scan(running).value()->reason, "cancelled");
  EXPECT_FALSE(runner_->cancel(running));
  EXPECT_FALSE(runner_->cancel("no scan"));

  executor_.hold = false;
  EXPECT_EQ(runner_->rerun(running, {{"work", {{"volume", 1}}}}).error().kind, Error::Kind::usage);
  EXPECT_EQ(runner_->rerun(running, {{"dance", json::object()}}).error().kind, Error::Kind::usage);
  ASSERT_TRUE(runner_->rerun(running, {{"work", {{"grain", 7}}}}));
  EXPECT_TRUE(reaches(running, StorePhase::done));
  EXPECT_EQ(executor_.options(), (json{{"work", {{"grain", 7}}}}));
  // What was asked for before stays until it is taken back.
  ASSERT_TRUE(runner_->rerun(running));
  EXPECT_TRUE(reaches(running, StorePhase::done));
  EXPECT_EQ(executor_.options(), (json{{"work", {{"grain", 7}}}}));
  ASSERT_TRUE(runner_->rerun(running, {{"work", {{"grain", nullptr}}}}));
  EXPECT_TRUE(reaches(running, StorePhase::done));
  EXPECT_EQ(executor_.options(), (json{{"work", {{"grain", 5}}}}));
}

TEST_F(RunnerTest, AScanInWorkIsDeleted) {
  executor_.hold = true;
  const std::string scan = queue_scan();
  start();
  ASSERT_TRUE(eventually([&] { return executor_.begun().size() == 1; }));
  const Result<DeletionReceipt> receipt = runner_->delete_scan(scan);
  ASSERT_TRUE(receipt) << receipt.error().message();
  EXPECT_FALSE(store_->scan(scan).value());
  EXPECT_FALSE(std::filesystem::exists(store_->bundle(scan).root()));
  EXPECT_FALSE(runner_->delete_scan(scan));
}

TEST_F(RunnerTest, AStopLeavesWhatIsInWorkForTheNextStart) {
  executor_.hold = true;
  const std::string scan = queue_scan();
  start();
  ASSERT_TRUE(eventually([&] { return executor_.begun().size() == 1; }));
  runner_->stop();
  EXPECT_EQ(store_->scan(scan).value()->phase, StorePhase::running);
  runner_.reset();
  store_.reset();
  store_ = Store::open(folder_.path()).value();
  executor_.hold = false;
  start();
  EXPECT_TRUE(reaches(scan, StorePhase::done));
}

TEST_F(RunnerTest, AHeartbeatKeepsALeaseAndItsLackGivesTheJobToAnother) {
  executor_.hold = true;
  const std::string scan = queue_scan();
  start();
  ASSERT_TRUE(eventually([&] { return executor_.begun().size() == 1; }));
  // Twice the lease in steps, during which it keeps asking: the job stays where it is.
  const auto lease = store_->jobs()->at(0).lease;
  for (int i = 0; i < 8; ++i) {
    later_ms_ += static_cast<int>(options_.lease.count() / 4) + 1;
    runner_->wake();
    // The first may have begun before the step.
    ASSERT_TRUE(eventually([&, before = executor_.asked.load()] { return executor_.asked >= before + 2; }));
  }
  EXPECT_EQ(store_->jobs()->at(0).lease, lease);
  EXPECT_EQ(store_->jobs()->at(0).tries, 1);
  // It falls silent: the job is queued again, and what the old thread makes of it does not count.
  executor_.deaf = true;
  ASSERT_TRUE(eventually([&] {
    later_ms_ += static_cast<int>(options_.lease.count()) / 8;
    runner_->wake();
    return store_->jobs()->at(0).phase == StorePhase::queued;
  }));
  executor_.hold = false;
  ASSERT_TRUE(eventually([&] {
    later_ms_ += static_cast<int>(options_.lease.count()) / 8;
    runner_->wake();
    return store_->scan(scan).value()->phase == StorePhase::done;
  }));
  EXPECT_EQ(executor_.begun().size(), 2U);
}

TEST_F(RunnerTest, DevicesTakeTurns) {
  options_.scans_at_once = 2;
  executor_.hold = true;
  std::vector<std::string> many;
  for (int i = 0; i < 4; ++i) many.push_back(queue_scan("many"));
  const std::string few = queue_scan("few");
  start();
  ASSERT_TRUE(eventually([&] { return executor_.begun().size() == 2; }));
  const std::vector<std::string> begun = executor_.begun();
  EXPECT_EQ(std::count(begun.begin(), begun.end(), few), 1);
}

// Stages of several scans share four cores; each waits in line, none takes more than its part.
TEST(LocalExecutor, SharesCoresAndMemory) {
  std::mutex mutex;
  std::condition_variable changed;
  int cores = 0;
  int running = 0;
  int most_cores = 0;
  int most_running = 0;
  int first_cores = 0;
  bool release = false;
  const RunStage run_stage = [&](const Stage& stage, const StageContext& context,
                                 const Ask&) -> tl::expected<StageOutcome, PipelineFailure> {
    std::unique_lock lock(mutex);
    if (first_cores == 0) first_cores = context.threads;
    most_cores = std::max(most_cores, cores += context.threads);
    most_running = std::max(most_running, ++running);
    changed.notify_all();
    changed.wait(lock, [&] { return release; });
    cores -= context.threads;
    --running;
    lock.unlock();
    return write_file(context.out / "text", stage.name) ? StageOutcome{json::object(), {}} : StageOutcome{};
  };
  LocalExecutor executor(4, 4.0, run_stage);
  Stage wide;
  wide.name = "wide";
  wide.estimate = {true, 1.5, 0.0, 1.0, 0.0};
  Stage narrow;
  narrow.name = "narrow";
  narrow.estimate = {false, 3.0, 0.0, 1.0, 0.0};
  const TemporaryFolder folder;
  const auto run = [&](const std::string& name) {
    const Bundle bundle(folder.path() / name);
    std::filesystem::create_directories(bundle.root());
    const ScanOutcome outcome = executor.run(
        {wide, narrow}, {name, bundle, {}}, [](const std::string&, double, std::string_view) {},
        [] { return Order::go_on; });
    EXPECT_TRUE(outcome && outcome->size() == 2);
  };
  std::vector<std::thread> scans;
  scans.emplace_back(run, "a");
  {
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return running == 1; });
  }
  EXPECT_EQ(first_cores, 4);  // alone: all of them
  for (const char* name : {"b", "c"}) scans.emplace_back(run, name);
  {
    const std::scoped_lock lock(mutex);
    release = true;
    changed.notify_all();
  }
  for (std::thread& scan : scans) scan.join();
  EXPECT_LE(most_cores, 4);
  EXPECT_LE(most_running, 2);  // 1.5 + 1.5 GiB fit into 4, 3 GiB go alone
}

TEST(Budget, ALargeShareIsNotOvertakenForEver) {
  Budget budget(2, 1.0);
  const Ask go_on = [] { return Order::go_on; };
  auto first = budget.take(1, 0.1, go_on);
  std::atomic<int> order{0};
  int large_at = 0;
  int small_at = 0;
  std::atomic<bool> large_asked{false};
  std::thread large([&] {
    const auto share = budget.take(5, 0.1, [&] {
      large_asked = true;
      return Order::go_on;
    });
    EXPECT_EQ(share->cores(), 2);
    large_at = ++order;
  });
  ASSERT_TRUE(eventually([&] { return large_asked.load(); }));
  std::thread small([&] {
    const auto share = budget.take(1, 0.1, go_on);
    small_at = ++order;
  });
  EXPECT_FALSE(budget.take(1, 0.1, [] { return Order::cancel; }));
  first.reset();
  large.join();
  small.join();
  EXPECT_EQ(large_at, 1);
  EXPECT_EQ(small_at, 2);
}

}  // namespace
}  // namespace gyre
