// SPDX-License-Identifier: Apache-2.0
// A log line as a JSON object, for those who collect logs of many machines.
#pragma once

#include <spdlog/formatter.h>
#include <memory>
#include <string>
#include <string_view>

namespace gyre {

class JsonLogFormatter : public spdlog::formatter {
 public:
  // scan: of lines that name none; may be empty.
  JsonLogFormatter(std::string program, std::string scan) : program_(std::move(program)), scan_(std::move(scan)) {}

  void format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& out) override;
  std::unique_ptr<spdlog::formatter> clone() const override {
    return std::make_unique<JsonLogFormatter>(program_, scan_);
  }

 private:
  std::string program_, scan_;
};

// The id after the first "scan " or "scans/" of a message that has one there, or empty.
std::string_view scan_named_in(std::string_view message);

}  // namespace gyre
