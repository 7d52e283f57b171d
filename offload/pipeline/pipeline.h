// SPDX-License-Identifier: Apache-2.0
// Runs the stages of a scan in order; a stage whose inputs and options have not changed is not run again.
#pragma once

#include "common/bundle/stage.h"
#include "common/result/result.h"

#include <atomic>
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

// A stage's stage.json says: stage, version, inputs (path -> SHA-256), options, seconds, cpu_seconds, peak_memory_mib,
// software, result. The work folder appears by rename when the stage has succeeded, so an interrupted run leaves
// finished stages only. Errors: an unknown stage in `until` or `stage_options`, an unknown option, or the failing
// stage's own.
Result<std::vector<StageReport>> run_pipeline(const std::vector<Stage>& stages, const Bundle& bundle,
                                              const PipelineOptions& options, const PipelineProgress& progress,
                                              const std::atomic<bool>& cancel);

}  // namespace gyre
