// SPDX-License-Identifier: Apache-2.0
#include "offload/pipeline/slurm_executor.h"

#include "common/bundle/atomic_file.h"
#include "offload/pipeline/needs.h"
#include "offload/pipeline/planned_stage.h"
#include "offload/pipeline/slurm.h"

#include <spdlog/spdlog.h>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <thread>

namespace gyre {

namespace {

namespace fs = std::filesystem;

PipelineFailure failure_of(const std::string& stage, FailureCause cause, const Error& error) {
  PipelineFailure failure{error};
  failure.cause = cause;
  failure.stage = stage;
  return failure;
}

// What a job that ended without a word of its own came to.
FailureCause cause_of(const std::string& state) {
  if (state.starts_with("OUT_OF_ME")) return FailureCause::memory;
  if (state.starts_with("CANCELLED")) return FailureCause::cancelled;
  if (state.starts_with("FAILED") || state.starts_with("COMPLETED")) return FailureCause::crash;
  return FailureCause::lost;  // TIMEOUT, NODE_FAIL, PREEMPTED, BOOT_FAIL, or forgotten
}

}  // namespace

Result<void> SlurmOptions::check() const {
  if (cores < 1) return wrong_use("a job needs a core", std::to_string(cores));
  if (poll.count() < 1) return wrong_use("poll is not positive");
  if (!(margin >= 1.0)) return wrong_use("margin is less than one");
  return {};
}

// The jobs of one scan.
class SlurmExecutor::Chain {
 public:
  Chain(const SlurmOptions& options, const std::vector<Stage>& stages, const ScanWork& work)
      : options_(options), stages_(stages), work_(work), folder_(fs::absolute(work.bundle.work(".slurm"))) {}

  // Finds the jobs of before, or submits new ones.
  Result<void> begin();
  // Looks once; what came of the scan when that is decided.
  std::optional<ScanOutcome> look(const PipelineProgress& progress);
  Result<void> cancel() const;
  const std::string& stage() const { return stages_[std::min(current_, stages_.size() - 1)].name; }

 private:
  Result<void> submit_all();
  SlurmJob job_of(const Stage& stage, const SlurmNode& largest) const;
  fs::path file(const Stage& stage, const char* suffix) const { return folder_ / (stage.name + suffix); }
  std::string prefix() const { return "gyre-" + work_.scan + "-"; }
  ScanOutcome fail_with(const PipelineFailure& failure) const;
  void hear(const PipelineProgress& progress);

  const SlurmOptions& options_;
  const std::vector<Stage>& stages_;
  const ScanWork& work_;
  fs::path folder_;
  std::map<std::string, std::string> ids_;  // by name of the job
  std::size_t current_ = 0;
  std::streamoff heard_ = 0;  // of what the current stage says
  StageReports said_;
  std::vector<StageReport> reports_;
  int silent_looks_ = 0;  // at a stage that is not in the queue any more
};

Result<void> SlurmExecutor::Chain::begin() {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error) return fail("cannot create", folder_.string() + " (" + error.message() + ")");
  Result<std::map<std::string, std::string>> alive = jobs_in_queue(prefix());
  if (!alive) return tl::unexpected(alive.error());
  if (alive->empty()) return submit_all();
  ids_ = std::move(*alive);
  spdlog::info("scan {}: goes on with {} jobs in Slurm", work_.scan, ids_.size());
  return {};
}

SlurmJob SlurmExecutor::Chain::job_of(const Stage& stage, const SlurmNode& largest) const {
  constexpr double seconds_per_minute = 60.0;
  constexpr double least_minutes = 5.0;
  constexpr double memory_margin = 1.25;
  const StageNeeds needs = needs_of(stage, work_.bundle);
  const int wanted = work_.options.threads > 0 ? std::min(work_.options.threads, options_.cores) : options_.cores;
  std::error_code error;
  const fs::path program = fs::canonical(options_.program, error);
  SlurmJob job;
  job.name = prefix() + stage.name;
  job.command = {error ? options_.program.string() : program.string(), "stage",  stage.name,
                 fs::absolute(work_.bundle.root()).string(),           "--plan", file(stage, ".json").string()};
  job.out = file(stage, ".out");
  job.err = file(stage, ".err");
  job.cores = needs.parallel ? std::min(wanted, largest.cores) : 1;
  job.memory_gib = std::min(memory_margin * needs.memory_gib, largest.memory_gib);
  job.minutes = least_minutes + options_.margin * needs.core_seconds / job.cores / seconds_per_minute;
  job.partition = options_.partition;
  return job;
}

Result<void> SlurmExecutor::Chain::submit_all() {
  const Result<SlurmNode> largest = largest_node(options_.partition);
  if (!largest) return tl::unexpected(largest.error());
  std::string before;
  std::error_code error;
  for (const Stage& stage : stages_) fs::remove(file(stage, ".out"), error);
  for (const Stage& stage : stages_) {
    SlurmJob job = job_of(stage, *largest);
    PipelineOptions plan = work_.options;
    plan.threads = job.cores;
    nlohmann::json own = nlohmann::json::object();
    if (plan.stage_options.contains(stage.name)) own[stage.name] = plan.stage_options[stage.name];
    plan.stage_options = own;
    job.after = before;
    Result<void> planned = write_plan(file(stage, ".json"), plan);
    if (planned) {
      Result<std::string> id = submit(job);
      if (id) ids_[job.name] = before = std::move(*id);
      if (!id) planned = tl::unexpected(id.error());
    }
    if (!planned) {
      static_cast<void>(cancel());
      return planned;
    }
    if (stage.name == work_.options.until) break;
  }
  spdlog::info("scan {}: {} jobs submitted to Slurm, the last is {}", work_.scan, ids_.size(), before);
  return {};
}

void SlurmExecutor::Chain::hear(const PipelineProgress& progress) {
  const Stage& stage = stages_[current_];
  std::ifstream in(file(stage, ".out"), std::ios::binary);
  in.seekg(heard_);
  const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  heard_ += static_cast<std::streamoff>(text.size());
  said_.hear(text, [&](double fraction, std::string_view what) { progress(stage.name, fraction, what); });
}

std::optional<ScanOutcome> SlurmExecutor::Chain::look(const PipelineProgress& progress) {
  // The queue first: a job that is gone from it has said all it had to say.
  const Result<std::map<std::string, std::string>> alive = jobs_in_queue(prefix());
  if (!alive) {
    spdlog::warn("{}", alive.error().message());  // its controller may be away for a while
    return std::nullopt;
  }
  hear(progress);
  while (said_.report()) {
    reports_.push_back(*said_.report());
    const bool last = current_ + 1 == stages_.size() || stages_[current_].name == work_.options.until;
    if (last) return ScanOutcome(reports_);
    ++current_;
    heard_ = 0;
    silent_looks_ = 0;
    said_ = {};
    hear(progress);
  }
  const Stage& stage = stages_[current_];
  if (said_.failure()) {
    PipelineFailure failure = *said_.failure();
    failure.log = read_file(log_of_stage(work_.bundle, stage.name)).value_or("");
    return fail_with(failure);
  }
  const std::string name = prefix() + stage.name;
  constexpr int looks_before_it_counts = 3;  // a shared folder shows late what another machine wrote
  if (alive->contains(name) || ++silent_looks_ < looks_before_it_counts) return std::nullopt;
  const auto id = ids_.find(name);
  const std::string state = id == ids_.end() ? std::string() : end_state(id->second);
  PipelineFailure failure = failure_of(stage.name, cause_of(state),
                                       {"the job of the stage ended in Slurm as " + (state.empty() ? "unknown" : state),
                                        stage.name + (id == ids_.end() ? "" : ", job " + id->second), ""});
  failure.log = read_file(file(stage, ".err")).value_or("");
  const Result<void> kept = write_file(log_of_stage(work_.bundle, stage.name), failure.log + failure.message() + "\n");
  if (!kept) spdlog::warn("{}", kept.error().message());
  return fail_with(failure);
}

ScanOutcome SlurmExecutor::Chain::fail_with(const PipelineFailure& failure) const {
  if (const Result<void> done = cancel(); !done) spdlog::warn("{}", done.error().message());
  return tl::unexpected(failure);
}

Result<void> SlurmExecutor::Chain::cancel() const {
  std::vector<std::string> ids;
  for (const auto& [name, id] : ids_) ids.push_back(id);
  return cancel_jobs(ids);
}

SlurmExecutor::SlurmExecutor(SlurmOptions options) : options_(std::move(options)) {}

ScanOutcome SlurmExecutor::run(const std::vector<Stage>& stages, const ScanWork& work, const PipelineProgress& progress,
                               const Ask& ask) {
  if (const Result<void> known = check_stage_options(stages, work.options.stage_options); !known)
    return tl::unexpected(PipelineFailure{known.error()});
  Chain chain(options_, stages, work);
  if (const Result<void> begun = chain.begin(); !begun)
    return tl::unexpected(failure_of(chain.stage(), FailureCause::lost, begun.error()));
  constexpr std::chrono::milliseconds look_for_orders{200};
  auto due = std::chrono::steady_clock::now();
  while (true) {
    const Order order = ask();
    if (order == Order::cancel) {
      if (const Result<void> done = chain.cancel(); !done) spdlog::warn("{}", done.error().message());
    }
    if (order != Order::go_on) {
      return tl::unexpected(failure_of(chain.stage(), FailureCause::cancelled, {"cancelled", chain.stage(), ""}));
    }
    if (std::chrono::steady_clock::now() >= due) {
      if (std::optional<ScanOutcome> outcome = chain.look(progress)) return *outcome;
      due = std::chrono::steady_clock::now() + options_.poll;
    }
    std::this_thread::sleep_for(std::min(look_for_orders, options_.poll));
  }
}

}  // namespace gyre
