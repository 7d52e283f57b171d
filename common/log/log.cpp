// SPDX-License-Identifier: Apache-2.0
#include "common/log/log.h"

#include "common/log/json_format.h"
#include "common/log/log_format.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <unistd.h>
#include <algorithm>
#include <cstdio>
#include <memory>

namespace gyre {

namespace {

// What start_logging was told. Set before there are threads.
struct Started {
  std::string program;
  LogFormat format = LogFormat::text;
};
Started& started() {
  static Started told;
  return told;
}

}  // namespace

void start_logging(const std::string& program, const std::string& level) {
  start_logging(program, level, LogFormat::text);
}

void start_logging(const std::string& program, const std::string& level, LogFormat format) {
  started() = {program, format};
  std::shared_ptr<spdlog::logger> logger;
  if (format == LogFormat::json) {
    logger = std::make_shared<spdlog::logger>(program, std::make_shared<spdlog::sinks::stderr_sink_mt>());
    logger->set_formatter(std::make_unique<JsonLogFormatter>(program, ""));
  } else {
    logger = std::make_shared<spdlog::logger>(program, std::make_shared<spdlog::sinks::stderr_color_sink_mt>());
    logger->set_pattern("%Y-%m-%dT%H:%M:%S.%e %^%l%$ %n: %v");
  }
  logger->set_level(spdlog::level::from_str(level));
  logger->flush_on(spdlog::level::info);
  spdlog::set_default_logger(std::move(logger));
}

LogFormat log_format() {
  return started().format;
}

void set_log_scan(const std::string& scan_id) {
  if (log_format() != LogFormat::json) return;
  spdlog::default_logger()->set_formatter(std::make_unique<JsonLogFormatter>(started().program, scan_id));
}

void change_log_level(int steps) {
  const int next = std::clamp(static_cast<int>(spdlog::get_level()) - steps, static_cast<int>(spdlog::level::trace),
                              static_cast<int>(spdlog::level::err));
  const auto level = static_cast<spdlog::level::level_enum>(next);
  spdlog::set_level(level);
  // At that very level, so that it is said in any case.
  spdlog::log(level, "messages from level {} on are logged from now on", spdlog::level::to_string_view(level));
}

void hand_on_log_line(std::string_view line) {
  if (log_format() == LogFormat::json && !line.starts_with('{')) {
    spdlog::log(std::max(spdlog::get_level(), spdlog::level::info), "{}", line);
    return;
  }
  const std::string whole = std::string(line) + "\n";
  static_cast<void>(std::fwrite(whole.data(), 1, whole.size(), stderr));
}

Progress terminal_progress(std::string label) {
  const bool terminal = isatty(STDERR_FILENO) == 1;
  return [label = std::move(label), terminal, last = -1](double fraction, std::string_view what) mutable {
    constexpr int width = 30;
    const int percent = static_cast<int>(100.0 * std::min(1.0, std::max(0.0, fraction)));
    const int step = terminal ? percent : percent / 10;
    if (step == last) return;
    last = step;
    if (!terminal) {
      spdlog::info("{} {}% {}", label, percent, what);
      return;
    }
    const int filled = percent * width / 100;
    std::fprintf(stderr, "\r\033[K%s [%s%s] %3d%% %.*s%s", label.c_str(), std::string(filled, '#').c_str(),
                 std::string(width - filled, '.').c_str(), percent, static_cast<int>(what.size()), what.data(),
                 percent == 100 ? "\n" : "");
  };
}

}  // namespace gyre
