// SPDX-License-Identifier: Apache-2.0
// Works through the jobs of a store: several scans at once, each with a lease, tried again when that may help.
#pragma once

#include "offload/pipeline/executor.h"
#include "offload/store/store.h"

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace gyre {

struct RunnerOptions {
  int scans_at_once = 2;
  std::chrono::milliseconds lease{60'000};  // a job not heard of for that long is given to another
  // Wait before the second try, the third, ...; no more than that.
  std::vector<std::chrono::milliseconds> retry_waits = {std::chrono::seconds(10), std::chrono::minutes(1),
                                                        std::chrono::minutes(5)};

  Result<void> check() const;
};

// How long to wait before a job that failed for that cause in its `tries`th try is tried again; nothing: it is not. For
// want of space it is tried until there is some.
std::optional<std::chrono::milliseconds> retry_wait(const RunnerOptions& options, FailureCause cause, int tries);

// What the runner tells, from threads of its own. All must return soon.
struct RunnerEvents {
  std::function<void(const std::string& scan, const std::string& stage, double fraction, const std::string& text)>
      progress;
  // The results lie in the bundle; records them. An error fails the job.
  std::function<Result<void>(const std::string& scan)> done;
  // The job will not be tried again by itself; records that.
  std::function<Result<void>(const std::string& scan, const std::string& reason)> failed;
  // The options of a scan's stages, apart from those somebody ran it again with.
  std::function<Result<PipelineOptions>(const Scan& scan)> options;
  std::function<WallTime()> now = wall_time_now;
};

struct ScanStatus {
  std::string scan;
  StorePhase state = StorePhase::queued;
  std::string stage;  // while running
  double fraction = 0.0;
  std::string text;    // what it does, or why it failed or waits
  int tries = 0;       // begun so far
  std::string device;  // its name
};

// Since the runner was made.
struct RunnerTally {
  std::uint64_t finished = 0, failed = 0, cancelled = 0;  // jobs
  std::map<std::string, std::uint64_t> retries;           // by cause
  std::map<std::string, std::uint64_t> stage_runs;        // by stage, of finished jobs; not those taken over
  std::map<std::string, double> stage_seconds;            // of those, wall time
};

// Jobs are those of the store; what fails leaves failure.json in the bundle: scan, stage, cause, message, tries, at and
// the end of the stage's log. All methods may be called from any thread.
class Runner {
 public:
  // options.check() must hold. Store and executor outlive it.
  Runner(RunnerOptions options, Store& store, Executor& executor, std::vector<Stage> stages, RunnerEvents events);
  ~Runner();  // stops
  Runner(const Runner&) = delete;
  Runner& operator=(const Runner&) = delete;

  void start();
  // Ends within a second; scans in work continue with the next start.
  void stop();
  // A job was queued.
  void wake();

  // All scans that have a job, oldest first.
  Result<std::vector<ScanStatus>> status() const;

  RunnerTally tally() const;

  // Ends the job of a queued or running scan for good; it is failed then. Returns when that is so.
  Result<void> cancel(const std::string& scan_id);
  // Queues a done or failed scan again. changes: stage name -> options that differ from what the scan was last run
  // with, null for one that goes back to its default; kept with the job.
  Result<void> rerun(const std::string& scan_id, const nlohmann::json& changes = nlohmann::json::object());
  // Deletes a scan from the store, and cancels its job before when it has one.
  Result<DeletionReceipt> delete_scan(const std::string& scan_id);

 private:
  class Worker;
  std::unique_ptr<Worker> worker_;
};

}  // namespace gyre
