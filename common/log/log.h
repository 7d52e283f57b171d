// SPDX-License-Identifier: Apache-2.0
// Logging and progress for both programs: one structured line per event on stderr, a bar when a person watches.
#pragma once

#include <spdlog/spdlog.h>
#include <functional>
#include <string>
#include <string_view>

namespace gyre {

// Reports how far a piece of work is: fraction in [0, 1] and what is being done. May be called from one thread at a
// time.
using Progress = std::function<void(double fraction, std::string_view what)>;

// Sends spdlog's default logger to stderr as `time level program: message`. level: trace, debug, info, warn, error.
void start_logging(const std::string& program, const std::string& level);

// A Progress that draws a bar on a terminal and logs every tenth elsewhere. label: what the whole work is called.
Progress terminal_progress(std::string label);

}  // namespace gyre
