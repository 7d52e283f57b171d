// SPDX-License-Identifier: Apache-2.0
// gyre-device: records scans on the rig, keeps them safe and sends them to the workstation.
#include "common/config/config.h"
#include "common/log/log_format.h"
#include "device/panel/panel.h"
#include "device/verbs.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>
#include <string>

int main(int argc, char** argv) {
  CLI::App app{"Gyre on the rig: camera in, scans out, avatars back", "gyre-device"};
  app.set_version_flag("--version", GYRE_VERSION);
  app.require_subcommand(1);
  std::string level = "info";
  app.add_option("--log-level", level, "least level of messages")
      ->check(CLI::IsMember({"trace", "debug", "info", "warning", "error"}))
      ->capture_default_str();
  gyre::LogFormat format = gyre::LogFormat::text;
  app.add_option("--log-format", format, "text for people, or json: one object a line, with the scan as a field")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, gyre::LogFormat>{{"text", gyre::LogFormat::text}, {"json", gyre::LogFormat::json}}))
      ->default_str("text");
  gyre::add_config_option(app, "");
  gyre::Verb run;
  const auto panel = std::make_shared<gyre::PanelOptions>();
  gyre::add_run_verb(app, run, panel);
  gyre::add_replay_verb(app, run);
  gyre::add_panel_verb(app, run, panel);
  gyre::add_status_verb(app, run);
  gyre::add_pair_verb(app, run);
  gyre::add_calibrate_verb(app, run);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return app.exit(e);
    std::fprintf(stderr, "gyre-device: %s; see `gyre-device --help`\n", e.what());
    return 2;
  }
  gyre::start_logging("gyre-device", level, format);
  return run();
}
