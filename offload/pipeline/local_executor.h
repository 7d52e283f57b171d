// SPDX-License-Identifier: Apache-2.0
// Stages as processes on this machine, within a budget of cores and memory that all scans share.
#pragma once

#include "offload/pipeline/budget.h"
#include "offload/pipeline/executor.h"

#include <atomic>

namespace gyre {

class LocalExecutor : public Executor {
 public:
  // cores, memory_gib: of all stages at any time; 0: what the machine has. `run_stage` stands in for the process in
  // tests.
  explicit LocalExecutor(int cores = 0, double memory_gib = 0.0, RunStage run_stage = run_stage_process);

  // A stage gets its part of the cores: all of them for a scan that is alone. How many it gets changes no result.
  ScanOutcome run(const std::vector<Stage>& stages, const ScanWork& work, const PipelineProgress& progress,
                  const Ask& ask) override;

 private:
  const int cores_;
  Budget budget_;
  RunStage run_stage_;
  std::atomic<int> scans_{0};
};

}  // namespace gyre
