// SPDX-License-Identifier: Apache-2.0
// One stage in a process of its own, so that a crash stays there and its time and memory are its own.
#pragma once

#include "common/bundle/stage.h"
#include "common/result/result.h"

#include <atomic>
#include <filesystem>
#include <nlohmann/json.hpp>

namespace gyre {

// What the process used, from the kernel's accounting.
struct StageUsage {
  double seconds = 0;      // wall
  double cpu_seconds = 0;  // user and system
  double peak_memory_mib = 0;
};

struct StageOutcome {
  nlohmann::json result;  // what the stage returned
  StageUsage usage;
};

// Runs `gyre-offload stage NAME BUNDLE --worker ...` of this same executable and waits for it. `out` is the folder it
// writes to. Errors: the stage's own, or how the process ended. When `cancel` becomes true the process is killed.
// The process is killed too when this one dies.
Result<StageOutcome> run_stage_process(const Stage& stage, const StageContext& context,
                                       const std::atomic<bool>& cancel);

// The other side: runs `stage` in this process and speaks to the parent on stdout, one JSON object a line.
// Returns the exit code.
int run_stage_worker(const Stage& stage, StageContext context);

}  // namespace gyre
