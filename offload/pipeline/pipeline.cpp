// SPDX-License-Identifier: Apache-2.0
#include "offload/pipeline/pipeline.h"

#include "common/bundle/atomic_file.h"
#include "common/bundle/disk_space.h"
#include "common/bundle/sha256.h"

#include <spdlog/spdlog.h>
#include <algorithm>

namespace gyre {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::string_view record_name = "stage.json";

const Stage* find_stage(const std::vector<Stage>& stages, const std::string& name) {
  const auto found = std::find_if(stages.begin(), stages.end(), [&](const Stage& s) { return s.name == name; });
  return found == stages.end() ? nullptr : &*found;
}

Error unknown_stage(const std::string& name) {
  return wrong_use("no such stage", name, "see `gyre-offload stage --help`").value();
}

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

PipelineFailure failure_of(const Stage& stage, const Error& error) {
  PipelineFailure failure{error};
  failure.stage = stage.name;
  return failure;
}

// What it said last, for whoever looks into the bundle. A failure must not fail on that.
void keep_log(const Bundle& bundle, const PipelineFailure& failure) {
  if (failure.cause == FailureCause::cancelled) return;
  const Result<void> kept = write_file(log_of_stage(bundle, failure.stage), failure.log + failure.message() + "\n");
  if (!kept) spdlog::warn("{}", kept.error().message());
}

tl::expected<StageReport, PipelineFailure> run_one(const Stage& stage, const Bundle& bundle,
                                                   const PipelineOptions& pipeline, const PipelineProgress& progress,
                                                   const Ask& ask, const RunStage& run_stage) {
  const auto failed = [&](const Error& error) { return tl::unexpected(failure_of(stage, error)); };
  const Result<json> options = options_of(stage, pipeline.stage_options);
  if (!options) return failed(options.error());
  const Result<json> inputs = hashes_of_inputs(stage, bundle, *options);
  if (!inputs) return failed(inputs.error());

  const json record = record_of(bundle, stage.name);
  if (is_current(record, stage, *inputs, *options)) {
    if (Result<void> published = publish(stage, bundle); !published) return failed(published.error());
    progress(stage.name, 1.0, "already done");
    return StageReport{stage.name, true, record.value("seconds", 0.0), record.value("cpu_seconds", 0.0),
                       record.value("peak_memory_mib", 0.0)};
  }

  const fs::path part = bundle.root() / "work" / ("." + stage.name + ".part");
  std::error_code error;
  fs::remove_all(part, error);
  fs::create_directories(part, error);
  if (error) {
    const bool full = error == std::errc::no_space_on_device;
    return failed({"cannot create", part.string() + " (" + error.message() + ")",
                   full ? std::string(full_disk_remedy) + " and try again" : "check the rights there"});
  }

  StageContext context{bundle,
                       part,
                       *options,
                       pipeline.threads,
                       pipeline.memory_gib,
                       pipeline.seed,
                       [&](double fraction, std::string_view what) { progress(stage.name, fraction, what); }};
  progress(stage.name, 0.0, "starting");
  tl::expected<StageOutcome, PipelineFailure> outcome = run_stage(stage, context, ask);
  if (!outcome) {
    fs::remove_all(part, error);
    keep_log(bundle, outcome.error());
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
  if (!done) return failed(done.error());
  fs::remove(log_of_stage(bundle, stage.name), error);
  progress(stage.name, 1.0, "done");
  return StageReport{stage.name, false, usage.seconds, usage.cpu_seconds, usage.peak_memory_mib};
}

}  // namespace

tl::expected<std::vector<StageReport>, PipelineFailure> run_pipeline(const std::vector<Stage>& stages,
                                                                     const Bundle& bundle,
                                                                     const PipelineOptions& options,
                                                                     const PipelineProgress& progress, const Ask& ask,
                                                                     const RunStage& run_stage) {
  if (!options.until.empty() && !find_stage(stages, options.until))
    return tl::unexpected(PipelineFailure{unknown_stage(options.until)});
  if (const Result<void> known = check_stage_options(stages, options.stage_options); !known)
    return tl::unexpected(PipelineFailure{known.error()});
  std::vector<StageReport> reports;
  for (const Stage& stage : stages) {
    tl::expected<StageReport, PipelineFailure> report = run_one(stage, bundle, options, progress, ask, run_stage);
    if (!report) return tl::unexpected(report.error());
    reports.push_back(std::move(*report));
    if (stage.name == options.until) break;
  }
  return reports;
}

Result<void> check_stage_options(const std::vector<Stage>& stages, const json& stage_options) {
  if (stage_options.is_null()) return {};
  if (!stage_options.is_object()) return wrong_use("options of stages are not an object", stage_options.dump());
  for (const auto& [name, value] : stage_options.items()) {
    const Stage* stage = find_stage(stages, name);
    if (!stage) return tl::unexpected(unknown_stage(name));
    if (!value.is_object()) return wrong_use("options of a stage are not an object", name);
    if (const Result<json> options = options_of(*stage, stage_options); !options)
      return tl::unexpected(options.error());
  }
  return {};
}

fs::path log_of_stage(const Bundle& bundle, const std::string& stage) {
  return bundle.root() / "work" / (stage + ".log");
}

}  // namespace gyre
