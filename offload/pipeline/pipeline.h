// SPDX-License-Identifier: Apache-2.0
// Runs the stages of a scan in order; a stage whose inputs and options have not changed is not run again.
#pragma once

#include "common/bundle/stage.h"
#include "common/result/result.h"
#include "offload/pipeline/stage_process.h"

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace gyre {

struct PipelineOptions {
  std::string until;             // last stage to run; empty: all
  nlohmann::json stage_options;  // stage name -> options that differ from its defaults
  int threads = 0;
  double memory_gib = 4.0;
  std::uint64_t seed = 1;
};

struct StageReport {
  std::string name;
  bool resumed = false;  // its result was already there
  double seconds = 0;
  double cpu_seconds = 0;
  double peak_memory_mib = 0;
};

// Name of the running stage, its own fraction, what it does.
using PipelineProgress = std::function<void(const std::string& stage, double fraction, std::string_view what)>;

// Carries out one stage; run_stage_process, or that with a wait before it.
using RunStage = std::function<tl::expected<StageOutcome, PipelineFailure>(
    const Stage& stage, const StageContext& context, const Ask& ask)>;

// A stage's stage.json says: stage, version, inputs (path -> SHA-256), options, seconds, cpu_seconds, peak_memory_mib,
// software, result. The work folder appears by rename when the stage has succeeded, so an interrupted run leaves
// finished stages only; one that fails leaves the last of its messages in work/<stage>.log. Errors: an unknown stage in
// `until` or `stage_options`, an unknown option, or the failing stage's own.
tl::expected<std::vector<StageReport>, PipelineFailure> run_pipeline(const std::vector<Stage>& stages,
                                                                     const Bundle& bundle,
                                                                     const PipelineOptions& options,
                                                                     const PipelineProgress& progress, const Ask& ask,
                                                                     const RunStage& run_stage = run_stage_process);

// What run_pipeline would refuse of `stage_options` before it starts: unknown stages and options.
Result<void> check_stage_options(const std::vector<Stage>& stages, const nlohmann::json& stage_options);

// Where a failing stage leaves its last messages.
std::filesystem::path log_of_stage(const Bundle& bundle, const std::string& stage);

}  // namespace gyre
