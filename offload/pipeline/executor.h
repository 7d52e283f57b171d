// SPDX-License-Identifier: Apache-2.0
// Where the stages of a scan run: on this machine, or on a cluster.
#pragma once

#include "offload/pipeline/order.h"
#include "offload/pipeline/pipeline.h"

#include <string>
#include <vector>

namespace gyre {

struct ScanWork {
  std::string scan;
  Bundle bundle;
  PipelineOptions options;
};

using ScanOutcome = tl::expected<std::vector<StageReport>, PipelineFailure>;

class Executor {
 public:
  Executor() = default;
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;
  virtual ~Executor() = default;

  // Runs the stages of a scan and returns when they have ended, well or not; may be called from several threads, with a
  // scan each. A failing stage leaves its log as run_pipeline says.
  virtual ScanOutcome run(const std::vector<Stage>& stages, const ScanWork& work, const PipelineProgress& progress,
                          const Ask& ask) = 0;
};

}  // namespace gyre
