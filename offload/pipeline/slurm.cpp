// SPDX-License-Identifier: Apache-2.0
#include "offload/pipeline/slurm.h"

#include "offload/pipeline/command.h"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace gyre {

namespace {

constexpr double mib_per_gib = 1024.0;

Result<std::string> said_by(const std::vector<std::string>& words) {
  Result<CommandOutcome> outcome = run_command(words);
  if (!outcome) return tl::unexpected(outcome.error());
  if (outcome->code == 0) return std::move(outcome->out);
  return fail("Slurm refuses", words[0] + " (" + outcome->err.substr(0, outcome->err.find('\n')) + ")",
              "look at `sinfo` and the cluster's log");
}

// For the shell of the job's script.
std::string quoted(const std::string& word) {
  std::string text(1, '\'');
  for (const char c : word) {
    if (c == '\'') text.append("'\\'");  // the quotation ends, and the mark itself begins the next
    text.push_back(c);
  }
  text.push_back('\'');
  return text;
}

}  // namespace

Result<SlurmNode> largest_node(const std::string& partition) {
  std::vector<std::string> words = {"sinfo", "--noheader", "--Node", "--format=%c %m"};
  if (!partition.empty()) words.push_back("--partition=" + partition);
  const Result<std::string> said = said_by(words);
  if (!said) return tl::unexpected(said.error());
  SlurmNode largest;
  std::istringstream lines(*said);
  for (std::string line; std::getline(lines, line);) {
    int cores = 0;
    double memory_mib = 0.0;
    if (!(std::istringstream(line) >> cores >> memory_mib)) continue;
    largest.cores = std::max(largest.cores, cores);
    largest.memory_gib = std::max(largest.memory_gib, memory_mib / mib_per_gib);
  }
  if (largest.cores > 0) return largest;
  return fail("Slurm has no nodes there", partition, "look at `sinfo`");
}

Result<std::string> submit(const SlurmJob& job) {
  std::string command = "exec";
  for (const std::string& word : job.command) command.append(1, ' ').append(quoted(word));
  std::vector<std::string> words = {
      "sbatch",
      "--parsable",
      "--no-requeue",
      "--job-name=" + job.name,
      "--cpus-per-task=" + std::to_string(job.cores),
      "--mem=" + std::to_string(static_cast<int>(std::ceil(job.memory_gib * mib_per_gib))),
      "--time=" + std::to_string(static_cast<int>(std::ceil(job.minutes))),
      "--open-mode=truncate",
      "--output=" + job.out.string(),
      "--error=" + job.err.string()};
  if (!job.partition.empty()) words.push_back("--partition=" + job.partition);
  if (!job.after.empty()) {
    words.push_back("--dependency=afterok:" + job.after);
    words.emplace_back("--kill-on-invalid-dep=yes");
  }
  words.insert(words.end(), {"--wrap", command});
  const Result<std::string> said = said_by(words);
  if (!said) return tl::unexpected(said.error());
  const std::string id = said->substr(0, said->find_first_of(";\n"));  // a federation appends ;CLUSTER
  if (id.empty()) return fail("Slurm gives no job id", *said);
  return id;
}

Result<std::map<std::string, std::string>> jobs_in_queue(const std::string& name_prefix) {
  const Result<std::string> said = said_by({"squeue", "--noheader", "--me", "--format=%i %j"});
  if (!said) return tl::unexpected(said.error());
  std::map<std::string, std::string> jobs;
  std::istringstream lines(*said);
  std::string id;
  std::string name;
  while (lines >> id >> name) {
    if (name.starts_with(name_prefix)) jobs[name] = id;
  }
  return jobs;
}

std::string field_of(std::string_view record, std::string_view field) {
  const std::string key = std::string(field) + "=";
  for (std::size_t at = record.find(key); at != std::string_view::npos; at = record.find(key, at + 1)) {
    if (at > 0 && record[at - 1] != ' ' && record[at - 1] != '\n') continue;
    const std::size_t begin = at + key.size();
    return std::string(record.substr(begin, record.find_first_of(" \n", begin) - begin));
  }
  return {};
}

std::string end_state(const std::string& id) {
  if (const Result<std::string> record = said_by({"scontrol", "--oneliner", "show", "job", id})) {
    return field_of(*record, "JobState");
  }
  const Result<std::string> kept =
      said_by({"sacct", "--noheader", "--parsable2", "--allocations", "--jobs=" + id, "--format=State"});
  return kept ? kept->substr(0, kept->find_first_of(" \n")) : std::string();
}

Result<void> cancel_jobs(const std::vector<std::string>& ids) {
  if (ids.empty()) return {};
  std::vector<std::string> words = {"scancel", "--quiet"};
  words.insert(words.end(), ids.begin(), ids.end());
  const Result<std::string> said = said_by(words);
  if (!said) return tl::unexpected(said.error());
  return {};
}

}  // namespace gyre
