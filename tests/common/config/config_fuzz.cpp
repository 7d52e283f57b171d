// SPDX-License-Identifier: Apache-2.0
#include "common/config/config.h"
#include "tests/fuzz/fuzz.h"

#include <CLI/CLI.hpp>

// Any file is a configuration or an error of the command line.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const gyre::MemoryFile file(data, size);
  CLI::App app;
  gyre::add_config_option(app, "");
  std::string name;
  double height = 0.0;
  app.add_option("--name", name);
  CLI::App* run = app.add_subcommand("run");
  run->add_option("--height-mm", height);
  run->configurable();
  std::vector<std::string> arguments = {file.path().string(), "--config"};  // CLI11 takes them from the back
  try {
    app.parse(arguments);
  } catch (const CLI::Error&) {
    return 0;
  }
  return 0;
}
