// SPDX-License-Identifier: Apache-2.0
#include "offload/pipeline/pipeline.h"

#include "common/bundle/atomic_file.h"
#include "common/bundle/sha256.h"
#include "offload/pipeline/stage_process.h"

namespace gyre {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::string_view record_name = "stage.json";

Result<json> options_of(const Stage& stage, const json& given) {
  json options = stage.options.is_null() ? json::object() : stage.options;
  if (const auto it = given.find(stage.name); it != given.end()) {
    for (const auto& [key, value] : it->items()) {
      if (!options.contains(key))
        return wrong_use("unknown option", stage.name + "." + key, "see `gyre-offload stage --help`");
      options[key] = value;
    }
  }
  return options;
}

// Hashes of everything the stage reads. Times and memory in the records of earlier stages do not count.
Result<json> hashes_of_inputs(const Stage& stage, const Bundle& bundle, const json& options) {
  json hashes = json::object();
  std::error_code error;
  const auto add = [&](const std::string& name, const fs::path& path) -> Result<void> {
    if (!fs::exists(path, error)) return {};
    const Result<std::string> hash =
        fs::is_directory(path, error) ? sha256_of_folder(path, record_name) : sha256_of_file(path);
    if (!hash) return tl::unexpected(hash.error());
    hashes[name] = *hash;
    return {};
  };
  for (const std::string& input : stage.inputs) {
    if (Result<void> added = add(input, bundle.root() / input); !added) return tl::unexpected(added.error());
  }
  for (const std::string& key : stage.external) {
    const std::string path = options.value(key, "");
    if (path.empty()) continue;
    if (!fs::exists(path, error)) return wrong_use("no such file", path, "check the option " + stage.name + "." + key);
    if (Result<void> added = add("option " + key, path); !added) return tl::unexpected(added.error());
  }
  return hashes;
}

json record_of(const Bundle& bundle, const std::string& stage) {
  const Result<std::string> text = read_file(bundle.work(stage) / record_name);
  return text ? json::parse(*text, nullptr, false) : json();
}

bool is_current(const json& record, const Stage& stage, const json& inputs, const json& options) {
  return record.is_object() && record.value("version", 0) == stage.version &&
         record.value("inputs", json()) == inputs && record.value("options", json()) == options;
}

// Puts the published files into the bundle's root where they are missing or differ.
Result<void> publish(const Stage& stage, const Bundle& bundle) {
  for (const std::string& name : stage.published) {
    const Result<std::string> content = read_file(bundle.work(stage.name) / name);
    if (!content) return tl::unexpected(content.error());
    const Result<std::string> there = read_file(bundle.root() / name);
    if (there && *there == *content) continue;
    if (Result<void> written = write_file(bundle.root() / name, *content); !written) return written;
  }
  return {};
}

Result<void> sync_files(const fs::path& folder) {
  std::error_code error;
  for (const auto& entry : fs::recursive_directory_iterator(folder, error)) {
    if (Result<void> synced = sync_path(entry.path()); !synced) return synced;
  }
  if (error) return fail("cannot list", folder.string() + " (" + error.message() + ")");
  return sync_path(folder);
}

// Replaces work/<stage> by `part` so that a crash leaves no half folder under the final name.
Result<void> install(const fs::path& part, const fs::path& target) {
  if (Result<void> synced = sync_files(part); !synced) return synced;
  std::error_code error;
  fs::remove_all(target, error);
  if (error) return fail("cannot replace", target.string() + " (" + error.message() + ")");
  return rename_durably(part, target);
}

Result<StageReport> run_one(const Stage& stage, const Bundle& bundle, const PipelineOptions& pipeline,
                            const PipelineProgress& progress, const std::atomic<bool>& cancel) {
  const Result<json> options = options_of(stage, pipeline.stage_options);
  if (!options) return tl::unexpected(options.error());
  const Result<json> inputs = hashes_of_inputs(stage, bundle, *options);
  if (!inputs) return tl::unexpected(inputs.error());

  const json record = record_of(bundle, stage.name);
  if (is_current(record, stage, *inputs, *options)) {
    if (Result<void> published = publish(stage, bundle); !published) return tl::unexpected(published.error());
    progress(stage.name, 1.0, "already done");
    return StageReport{stage.name, true, record.value("seconds", 0.0), record.value("cpu_seconds", 0.0),
                       record.value("peak_memory_mib", 0.0)};
  }

  const fs::path part = bundle.root() / "work" / ("." + stage.name + ".part");
  std::error_code error;
  fs::remove_all(part, error);
  fs::create_directories(part, error);
  if (error)
    return fail("cannot create", part.string() + " (" + error.message() + ")", "check the space and rights there");

  StageContext context{bundle,
                       part,
                       *options,
                       pipeline.threads,
                       pipeline.memory_gib,
                       pipeline.seed,
                       [&](double fraction, std::string_view what) { progress(stage.name, fraction, what); }};
  progress(stage.name, 0.0, "starting");
  Result<StageOutcome> outcome = run_stage_process(stage, context, cancel);
  if (!outcome) {
    fs::remove_all(part, error);
    return tl::unexpected(outcome.error());
  }
  const StageUsage& usage = outcome->usage;
  const json finished = {{"stage", stage.name},
                         {"version", stage.version},
                         {"software", GYRE_VERSION},
                         {"inputs", *inputs},
                         {"options", *options},
                         {"seconds", usage.seconds},
                         {"cpu_seconds", usage.cpu_seconds},
                         {"peak_memory_mib", usage.peak_memory_mib},
                         {"result", outcome->result}};
  Result<void> done = write_file(part / record_name, finished.dump(2) + "\n");
  if (done) done = install(part, bundle.work(stage.name));
  if (done) done = publish(stage, bundle);
  if (!done) return tl::unexpected(done.error());
  progress(stage.name, 1.0, "done");
  return StageReport{stage.name, false, usage.seconds, usage.cpu_seconds, usage.peak_memory_mib};
}

}  // namespace

Result<std::vector<StageReport>> run_pipeline(const std::vector<Stage>& stages, const Bundle& bundle,
                                              const PipelineOptions& options, const PipelineProgress& progress,
                                              const std::atomic<bool>& cancel) {
  const auto known = [&](const std::string& name) {
    return std::any_of(stages.begin(), stages.end(), [&](const Stage& s) { return s.name == name; });
  };
  if (!options.until.empty() && !known(options.until))
    return wrong_use("no such stage", options.until, "see `gyre-offload stage --help`");
  for (const auto& [name, value] : options.stage_options.items()) {
    if (!known(name)) return wrong_use("no such stage", name, "see `gyre-offload stage --help`");
  }
  std::vector<StageReport> reports;
  for (const Stage& stage : stages) {
    Result<StageReport> report = run_one(stage, bundle, options, progress, cancel);
    if (!report) return tl::unexpected(report.error());
    reports.push_back(std::move(*report));
    if (stage.name == options.until) break;
  }
  return reports;
}

}  // namespace gyre
