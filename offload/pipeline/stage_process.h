// SPDX-License-Identifier: Apache-2.0
// One stage in a process of its own, so that a crash stays there and its time and memory are its own.
#pragma once

#include "common/bundle/stage.h"
#include "offload/pipeline/failure.h"
#include "offload/pipeline/order.h"

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
// writes to. Errors: the stage's own, or how the process ended, with the last of what it said on stderr. When the order
// is to end, the process is killed. The process is killed too when this one dies.
tl::expected<StageOutcome, PipelineFailure> run_stage_process(const Stage& stage, const StageContext& context,
                                                              const Ask& ask);

// The other side: runs `stage` in this process and speaks to the parent on stdout, one JSON object a line.
// Returns the exit code.
int run_stage_worker(const Stage& stage, StageContext context);

}  // namespace gyre
