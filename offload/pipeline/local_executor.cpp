// SPDX-License-Identifier: Apache-2.0
#include "offload/pipeline/local_executor.h"

#include "offload/pipeline/needs.h"

#include <unistd.h>
#include <algorithm>
#include <thread>

namespace gyre {

namespace {

int cores_of_machine() {
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

double memory_of_machine_gib() {
  constexpr double gib = 1 << 30;
  return static_cast<double>(::sysconf(_SC_PHYS_PAGES)) * static_cast<double>(::sysconf(_SC_PAGESIZE)) / gib;
}

}  // namespace

LocalExecutor::LocalExecutor(int cores, double memory_gib, RunStage run_stage)
    : cores_(cores > 0 ? cores : cores_of_machine()),
      budget_(cores_, memory_gib > 0 ? memory_gib : memory_of_machine_gib()),
      run_stage_(std::move(run_stage)) {}

ScanOutcome LocalExecutor::run(const std::vector<Stage>& stages, const ScanWork& work, const PipelineProgress& progress,
                               const Ask& ask) {
  const RunStage run_stage = [&](const Stage& stage, const StageContext& context,
                                 const Ask& order) -> tl::expected<StageOutcome, PipelineFailure> {
    const StageNeeds needs = needs_of(stage, work.bundle);
    const int most = context.threads > 0 ? std::min(context.threads, cores_) : cores_;
    context.progress(0.0, "waiting for its turn");
    const std::optional<Budget::Share> share =
        budget_.take(needs.parallel ? std::min(most, (cores_ + scans_ - 1) / scans_) : 1, needs.memory_gib, order);
    if (!share) {
      PipelineFailure failure{{"cancelled", stage.name, ""}};
      failure.cause = FailureCause::cancelled;
      failure.stage = stage.name;
      return tl::unexpected(failure);
    }
    context.progress(0.0, "starting");
    StageContext granted = context;
    granted.threads = share->cores();
    return run_stage_(stage, granted, order);
  };
  ++scans_;
  ScanOutcome outcome = run_pipeline(stages, work.bundle, work.options, progress, ask, run_stage);
  --scans_;
  return outcome;
}

}  // namespace gyre
