// SPDX-License-Identifier: Apache-2.0
// One stage of a scan as a job elsewhere: a file says what to do, and what was done is said on stdout, one JSON object
// a line.
#pragma once

#include "offload/pipeline/pipeline.h"

#include <filesystem>
#include <optional>
#include <string>

namespace gyre {

Result<void> write_plan(const std::filesystem::path& file, const PipelineOptions& options);

// Runs one stage of `stages` as the plan in `file` says. Returns the exit code.
int run_planned_stage(const std::vector<Stage>& stages, const std::string& name, const Bundle& bundle,
                      const std::filesystem::path& file);

// What such a job has said so far; fed with its output as it comes.
class StageReports {
 public:
  using Heard = std::function<void(double fraction, std::string_view what)>;
  void hear(std::string_view output, const Heard& progress);

  // Once it has ended, one of these is there.
  const std::optional<StageReport>& report() const { return report_; }
  const std::optional<PipelineFailure>& failure() const { return failure_; }

 private:
  std::string pending_;
  std::optional<StageReport> report_;
  std::optional<PipelineFailure> failure_;
};

}  // namespace gyre
