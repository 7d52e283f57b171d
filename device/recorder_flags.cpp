// SPDX-License-Identifier: Apache-2.0
#include "device/recorder_flags.h"

#include <CLI/CLI.hpp>
#include <map>

namespace gyre {

void add_flow_flag(CLI::App& verb, RecorderFlags& flags) {
  static const std::map<std::string, FlowMethod> methods = {{"farneback", FlowMethod::farneback},
                                                            {"dis", FlowMethod::dis}};
  verb.add_option("--flow", flags.flow,
                  "how movement is measured: farneback as published, dis in a third of the time (six of ten keyframes "
                  "are others)")
      ->transform(CLI::CheckedTransformer(methods))
      ->default_str("farneback");
}

void add_live_recorder_flags(CLI::App& verb, RecorderFlags& flags) {
  add_flow_flag(verb, flags);
  verb.add_option("--memory-mib", flags.memory_mib,
                  "for pictures of a live camera that may still become keyframes at the end of a pass, MiB")
      ->check(CLI::Range(1, 4096))
      ->capture_default_str();
}

RecorderOptions recorder_options(const RecorderFlags& given) {
  RecorderOptions options;
  options.memory = static_cast<std::size_t>(given.memory_mib) << 20;
  options.measure.flow = given.flow;
  return options;
}

}  // namespace gyre
