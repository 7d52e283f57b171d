// SPDX-License-Identifier: Apache-2.0
// How a program's log looks and how much is in it, for those who operate the program.
#pragma once

#include <string>
#include <string_view>

namespace gyre {

enum class LogFormat {
  text,  // time level program: message
  json,  // {"time", "level", "program", "scan", "message"}, one object a line
};

// Sends spdlog's default logger to stderr. level: trace, debug, info, warning, error. Messages about a scan name it as
// "scan ID"; in JSON the id is a field too.
void start_logging(const std::string& program, const std::string& level, LogFormat format);

LogFormat log_format();

// Every JSON line from now on is about that scan, whether or not it names one: for a process that works on one alone.
void set_log_scan(const std::string& scan_id);

// Says more (steps > 0: trace is the most) or less (steps < 0: error is the least) from now on, and logs that.
void change_log_level(int steps);

// A line that another process of ours logged, without its line break: handed on as it is, and in JSON made into an
// object when it is none, as the last words of a library are.
void hand_on_log_line(std::string_view line);

}  // namespace gyre
