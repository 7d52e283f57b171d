// SPDX-License-Identifier: Apache-2.0
// gyre-offload: receives scans and reconstructs avatars on the workstation.
#include "common/config/config.h"
#include "common/log/log_format.h"
#include "offload/verbs.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>
#include <string>

int main(int argc, char** argv) {
  CLI::App app{"Gyre on the workstation: scans in, avatars out", "gyre-offload"};
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
  gyre::add_serve_verb(app, run);
  gyre::add_reconstruct_verb(app, run);
  gyre::add_stage_verb(app, run);
  gyre::add_template_verb(app, run);
  gyre::add_pair_verb(app, run);
  gyre::add_evaluate_verb(app, run);
  gyre::add_store_verb(app, run);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return app.exit(e);
    std::fprintf(stderr, "gyre-offload: %s; see `gyre-offload --help`\n", e.what());
    return 2;
  }
  gyre::start_logging("gyre-offload", level, format);
  return run();
}
