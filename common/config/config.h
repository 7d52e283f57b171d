// SPDX-License-Identifier: Apache-2.0
// One TOML file and the same flags for both programs; a flag wins over the file.
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace gyre {

// Gives `app` the option --config FILE (TOML). Top-level keys are flags of the program, a table [verb] holds the flags
// of that verb; keys are the flags' names without dashes. A key that no flag has is an error that names it. `fallback`
// is read when it exists and --config is not given.
void add_config_option(CLI::App& app, const std::string& fallback);

}  // namespace gyre
