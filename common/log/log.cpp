// SPDX-License-Identifier: Apache-2.0
#include "common/log/log.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <unistd.h>
#include <cstdio>
#include <memory>

namespace gyre {

void start_logging(const std::string& program, const std::string& level) {
  auto logger = std::make_shared<spdlog::logger>(program, std::make_shared<spdlog::sinks::stderr_color_sink_mt>());
  logger->set_pattern("%Y-%m-%dT%H:%M:%S.%e %^%l%$ %n: %v");
  logger->set_level(spdlog::level::from_str(level));
  logger->flush_on(spdlog::level::info);
  spdlog::set_default_logger(std::move(logger));
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
