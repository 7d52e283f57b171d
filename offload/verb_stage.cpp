// SPDX-License-Identifier: Apache-2.0
#include "common/bundle/bundle.h"
#include "common/log/log_format.h"
#include "offload/orbit.h"
#include "offload/pipeline/planned_stage.h"
#include "offload/pipeline/stage_process.h"
#include "offload/verbs.h"

#include <CLI/CLI.hpp>
#include <memory>

namespace gyre {

namespace {

struct StageFlags {
  std::string name;
  std::string bundle;
  std::string worker;        // output folder; set only by the runner
  std::string options_json;  // set only by the runner
  std::string plan;          // file; set only by the runner, for a job elsewhere
  PipelineFlags flags;
};

// Lists the stages and their options with defaults for --help.
std::string describe_stages() {
  std::string text = "Stages and their options (for --set STAGE.OPTION=VALUE):\n";
  for (const Stage& stage : orbit_stages()) {
    text += "  " + stage.name;
    for (const auto& [key, value] : stage.options.items()) text += "  " + key + "=" + value.dump();
    text += "\n";
  }
  return text;
}

int run_stage(const StageFlags& given) {
  const std::vector<Stage> stages = orbit_stages();
  const auto stage = std::find_if(stages.begin(), stages.end(), [&](const Stage& s) { return s.name == given.name; });
  if (stage == stages.end())
    return report_error(wrong_use("no such stage", given.name, "see `gyre-offload stage --help`").value());
  const Bundle bundle(given.bundle);
  if (!given.worker.empty()) {
    if (const Result<Scan> scan = read_scan(bundle)) set_log_scan(scan->id);
    StageContext context{bundle,
                         given.worker,
                         nlohmann::json::parse(given.options_json, nullptr, false),
                         given.flags.pipeline.threads,
                         given.flags.pipeline.memory_gib,
                         given.flags.pipeline.seed};
    return run_stage_worker(*stage, std::move(context));
  }
  if (!given.plan.empty()) return run_planned_stage(stages, given.name, bundle, given.plan);
  const Result<Scan> scan = read_scan(bundle);
  if (!scan) return report_error(scan.error());
  Result<PipelineOptions> options = pipeline_options(given.flags, scan->height_mm);
  if (!options) return report_error(options.error());
  // Options of other stages (a template, a height) are none of this one's business.
  nlohmann::json own = nlohmann::json::object();
  if (options->stage_options.contains(given.name)) own[given.name] = options->stage_options[given.name];
  options->stage_options = own;
  options->until.clear();
  const Progress bar = terminal_progress(given.name);
  const auto reports = run_pipeline(
      {*stage}, bundle, *options, [&](const std::string&, double f, std::string_view what) { bar(f, what); },
      [] { return Order::go_on; });
  return reports ? 0 : report_error(reports.error());
}

}  // namespace

void add_stage_verb(CLI::App& app, Verb& run) {
  const auto flags = std::make_shared<StageFlags>();
  CLI::App* verb = app.add_subcommand("stage", "run one stage of the pipeline on a scan");
  verb->footer(describe_stages);
  verb->fallthrough();  // a worker is given its starter's log level
  verb->add_option("name", flags->name, "the stage")->required();
  verb->add_option("bundle", flags->bundle, "folder of the scan")->required();
  verb->add_option("--worker", flags->worker)->group("");
  verb->add_option("--options-json", flags->options_json)->group("");
  verb->add_option("--plan", flags->plan)->group("");
  add_pipeline_flags(*verb, flags->flags);
  verb->callback([flags, &run] { run = [flags] { return run_stage(*flags); }; });
}

}  // namespace gyre
