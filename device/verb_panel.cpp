// SPDX-License-Identifier: Apache-2.0
#include "common/log/log.h"
#include "device/panel_flags.h"
#include "device/stop_signals.h"
#include "device/verbs.h"

#include <CLI/CLI.hpp>
#include <array>
#include <condition_variable>
#include <cstdio>
#include <mutex>

namespace gyre {

namespace {

std::string_view name_of(OperatorCommand::Kind kind) {
  if (kind == OperatorCommand::Kind::cancel) return "long";
  return kind == OperatorCommand::Kind::shut_down ? "very_long" : "short";
}

// One of every colour, with all patterns and tones.
constexpr std::array trials = {Signal{Colour::white, Pattern::steady, Tone::low, ""},
                               Signal{Colour::green, Pattern::slow_blink, Tone::high, ""},
                               Signal{Colour::blue, Pattern::fast_blink, Tone::double_low, ""},
                               Signal{Colour::yellow, Pattern::pulse, Tone::double_high, ""},
                               Signal{Colour::red, Pattern::steady, Tone::rising, ""}};

int try_panel(const PanelOptions& options) {
  if (const Result<void> valid = options.check(); !valid) return report_error(valid.error());
  if (options.is_empty()) {
    return report_error(wrong_use("no panel is described", "", "name its lines, or give --config").value());
  }
  std::mutex mutex;
  std::condition_variable changed;
  bool is_stopped = false;
  const StopSignals signals([&] {
    {
      const std::lock_guard lock(mutex);
      is_stopped = true;
    }
    changed.notify_all();
  });
  std::vector<Error> troubles;
  const auto press = [](OperatorCommand::Kind kind) {
    std::printf("{\"press\":\"%s\"}\n", std::string(name_of(kind)).c_str());
    std::fflush(stdout);
  };
  Panel panel(options, press, troubles);
  for (const Error& trouble : troubles) spdlog::error("{}", trouble.message());
  spdlog::info("press the button, watch the lights; Ctrl-C ends this");
  std::unique_lock lock(mutex);
  for (std::size_t i = 0; !is_stopped; ++i) {
    LiveStatus status;
    status.signal = trials[i % trials.size()];
    panel.show(status);
    constexpr std::chrono::seconds each{3};
    changed.wait_for(lock, each, [&] { return is_stopped; });
  }
  return troubles.empty() ? 0 : 1;
}

}  // namespace

void add_panel_verb(CLI::App& app, Verb& run, const std::shared_ptr<PanelOptions>& options) {
  CLI::App* verb = app.add_subcommand("panel", "try button, lights and buzzer: shows every colour, prints every press");
  add_panel_flags(*verb, *options);
  verb->callback([options, &run] { run = [options] { return try_panel(*options); }; });
}

}  // namespace gyre
