// SPDX-License-Identifier: Apache-2.0
// A program that is run for what it says.
#pragma once

#include "common/result/result.h"

#include <chrono>
#include <string>
#include <vector>

namespace gyre {

struct CommandOutcome {
  int code = 0;  // exit code, or 128 + signal
  std::string out, err;
};

// Runs words[0], looked for in PATH, and waits for it; killed after `patience`. Errors: it cannot be started, or was
// killed for that.
Result<CommandOutcome> run_command(const std::vector<std::string>& words,
                                   std::chrono::milliseconds patience = std::chrono::seconds(60));

}  // namespace gyre
