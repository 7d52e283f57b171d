// SPDX-License-Identifier: Apache-2.0
#include "offload/pipeline/planned_stage.h"

#include "common/bundle/atomic_file.h"

#include <algorithm>
#include <array>
#include <cstdio>

namespace gyre {

namespace {

using nlohmann::json;

constexpr std::array<FailureCause, 5> causes = {FailureCause::stage, FailureCause::crash, FailureCause::memory,
                                                FailureCause::lost, FailureCause::cancelled};

FailureCause cause_named(const std::string& name) {
  for (const FailureCause cause : causes) {
    if (name_of(cause) == name) return cause;
  }
  return FailureCause::crash;
}

void say(const json& what) {
  std::puts(what.dump(-1, ' ', false, json::error_handler_t::replace).c_str());
  std::fflush(stdout);
}

Result<PipelineOptions> read_plan(const std::filesystem::path& file) {
  const Result<std::string> text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  const json plan = json::parse(*text, nullptr, false);
  if (!plan.is_object()) return wrong_use("not a plan of a stage", file.string());
  PipelineOptions options;
  options.stage_options = plan.value("stage_options", json::object());
  options.threads = plan.value("threads", options.threads);
  options.memory_gib = plan.value("memory_gib", options.memory_gib);
  options.seed = plan.value("seed", options.seed);
  return options;
}

}  // namespace

Result<void> write_plan(const std::filesystem::path& file, const PipelineOptions& options) {
  const json plan = {{"stage_options", options.stage_options},
                     {"threads", options.threads},
                     {"memory_gib", options.memory_gib},
                     {"seed", options.seed}};
  return write_file(file, plan.dump(2) + "\n");
}

int run_planned_stage(const std::vector<Stage>& stages, const std::string& name, const Bundle& bundle,
                      const std::filesystem::path& file) {
  const auto failed = [](const PipelineFailure& failure) {
    say({{"failure",
          {{"what", failure.what},
           {"where", failure.where},
           {"remedy", failure.remedy},
           {"usage", failure.kind == Error::Kind::usage},
           {"cause", name_of(failure.cause)},
           {"stage", failure.stage}}}});
    return failure.exit_code();
  };
  const auto stage = std::find_if(stages.begin(), stages.end(), [&](const Stage& s) { return s.name == name; });
  if (stage == stages.end()) return failed({wrong_use("no such stage", name).value()});
  const Result<PipelineOptions> options = read_plan(file);
  if (!options) return failed({options.error()});
  const auto reports = run_pipeline(
      {*stage}, bundle, *options,
      [](const std::string&, double fraction, std::string_view what) {
        say({{"fraction", fraction}, {"what", what}});
      },
      [] { return Order::go_on; });
  if (!reports) return failed(reports.error());
  const StageReport& report = reports->at(0);
  say({{"report",
        {{"name", report.name},
         {"resumed", report.resumed},
         {"seconds", report.seconds},
         {"cpu_seconds", report.cpu_seconds},
         {"peak_memory_mib", report.peak_memory_mib}}}});
  return 0;
}

void StageReports::hear(std::string_view output, const Heard& progress) {
  pending_.append(output);
  for (std::size_t end = pending_.find('\n'); end != std::string::npos; end = pending_.find('\n')) {
    const json said = json::parse(pending_.substr(0, end), nullptr, false);
    pending_.erase(0, end + 1);
    if (!said.is_object()) continue;
    if (said.contains("fraction")) progress(said["fraction"].get<double>(), said.value("what", ""));
    if (const auto it = said.find("report"); it != said.end()) {
      report_ = StageReport{it->value("name", ""), it->value("resumed", false), it->value("seconds", 0.0),
                            it->value("cpu_seconds", 0.0), it->value("peak_memory_mib", 0.0)};
    }
    if (const auto it = said.find("failure"); it != said.end()) {
      failure_ = PipelineFailure{{it->value("what", ""), it->value("where", ""), it->value("remedy", ""),
                                  it->value("usage", false) ? Error::Kind::usage : Error::Kind::failed}};
      failure_->cause = cause_named(it->value("cause", ""));
      failure_->stage = it->value("stage", "");
    }
  }
}

}  // namespace gyre
