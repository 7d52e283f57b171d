// SPDX-License-Identifier: Apache-2.0
// The few commands of Slurm that Gyre gives, and what they answer.
#pragma once

#include "common/result/result.h"

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace gyre {

struct SlurmJob {
  std::string name;
  std::vector<std::string> command;
  std::filesystem::path out, err;  // on a folder that all nodes share; both are started afresh
  int cores = 1;
  double memory_gib = 1.0;
  double minutes = 60.0;
  std::string partition;  // empty: the cluster's default
  std::string after;      // id of the job whose success it waits for; empty: none
};

struct SlurmNode {
  int cores = 0;
  double memory_gib = 0.0;
};

// The most cores and the most memory that a node of the partition (empty: of all) has; a job that asks for more waits
// for ever.
Result<SlurmNode> largest_node(const std::string& partition);

// Returns the id.
Result<std::string> submit(const SlurmJob& job);

// Name to id of the jobs that wait or run and whose names begin so.
Result<std::map<std::string, std::string>> jobs_in_queue(const std::string& name_prefix);

// The state of a job that has ended, in Slurm's words ("COMPLETED", "TIMEOUT", "OUT_OF_MEMORY", ...), from scontrol, or
// from accounting once that has forgotten it; empty when both have.
std::string end_state(const std::string& id);

Result<void> cancel_jobs(const std::vector<std::string>& ids);

// The value of a field in what `scontrol show job` prints; empty when it is not there.
std::string field_of(std::string_view record, std::string_view field);

}  // namespace gyre
