// SPDX-License-Identifier: Apache-2.0
#include "common/log/json_format.h"

#include <spdlog/details/log_msg.h>
#include <chrono>
#include <ctime>
#include <nlohmann/json.hpp>

namespace gyre {

namespace {

constexpr std::size_t id_length = 26;

// Length of the run of characters of a ULID (Crockford's base 32) that `text` starts with.
std::size_t id_run(std::string_view text) {
  constexpr std::string_view digits = "0123456789ABCDEFGHJKMNPQRSTVWXYZ";
  const std::size_t end = text.find_first_not_of(digits);
  return end == std::string_view::npos ? text.size() : end;
}

// "2026-01-31T08:15:00.123Z"
std::string utc_text(spdlog::log_clock::time_point time) {
  const auto since = time.time_since_epoch();
  const auto milliseconds = std::chrono::duration_cast<std::chrono::milliseconds>(since).count();
  const std::time_t seconds = milliseconds / 1000;
  std::tm parts{};
  ::gmtime_r(&seconds, &parts);
  char text[32];
  const std::size_t length = std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%S", &parts);
  return std::string(text, length) + fmt::format(".{:03}Z", milliseconds % 1000);
}

}  // namespace

std::string_view scan_named_in(std::string_view message) {
  for (const std::string_view before : {std::string_view("scan "), std::string_view("scans/")}) {
    for (std::size_t at = message.find(before); at != std::string_view::npos; at = message.find(before, at + 1)) {
      const std::string_view rest = message.substr(at + before.size());
      if (id_run(rest) == id_length) return rest.substr(0, id_length);
    }
  }
  return {};
}

void JsonLogFormatter::format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& out) {
  const std::string_view text(message.payload.data(), message.payload.size());
  const auto level = spdlog::level::to_string_view(message.level);
  nlohmann::ordered_json line = {
      {"time", utc_text(message.time)}, {"level", std::string(level.data(), level.size())}, {"program", program_}};
  const std::string_view named = scan_named_in(text);
  if (!named.empty() || !scan_.empty()) line["scan"] = named.empty() ? scan_ : std::string(named);
  line["message"] = text;
  const std::string bytes = line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
  out.append(bytes.data(), bytes.data() + bytes.size());
}

}  // namespace gyre
