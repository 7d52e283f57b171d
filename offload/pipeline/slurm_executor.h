// SPDX-License-Identifier: Apache-2.0
// Stages as jobs of a Slurm cluster, on a store that lies on a folder all nodes share.
#pragma once

#include "offload/pipeline/executor.h"

#include <chrono>
#include <filesystem>
#include <string>

namespace gyre {

struct SlurmOptions {
  std::string partition;                             // empty: the cluster's default
  int cores = 8;                                     // of a stage that can use several, as far as a node has them
  std::chrono::milliseconds poll{2000};              // between looks at the queue and at what the jobs say
  double margin = 4.0;                               // a stage may take that many times its own estimate
  std::filesystem::path program = "/proc/self/exe";  // what runs a stage, at that path on every node

  Result<void> check() const;
};

// The stages of a scan are submitted as one chain, each after the success of the one before, with cores, memory and
// time from its own estimate. Jobs are named gyre-<scan>-<stage>: when this program was away meanwhile, it finds those
// that still wait or run, and goes on with them.
class SlurmExecutor : public Executor {
 public:
  // options.check() must hold.
  explicit SlurmExecutor(SlurmOptions options);

  ScanOutcome run(const std::vector<Stage>& stages, const ScanWork& work, const PipelineProgress& progress,
                  const Ask& ask) override;

 private:
  class Chain;
  SlurmOptions options_;
};

}  // namespace gyre
