// SPDX-License-Identifier: Apache-2.0
// What a program's main loop tells the service manager as it goes round.
#pragma once

#include "common/service/service_manager.h"

#include <chrono>
#include <optional>
#include <string>
#include <string_view>

namespace gyre {

// Belongs to one thread. What cannot be told is logged once and then left.
class ServiceReport {
 public:
  using Clock = std::chrono::steady_clock;

  // The manager outlives this.
  explicit ServiceReport(const ServiceManager& manager) : manager_(manager) {}

  // The loop has come round, and the program is doing that. The first time it is ready; a sign of life goes out four
  // times in each interval of the watchdog, at the most.
  void beat(std::string_view status, Clock::time_point now = Clock::now());

 private:
  void check(const Result<void>& told);

  const ServiceManager& manager_;
  std::optional<std::string> status_;
  std::optional<Clock::time_point> alive_at_;
  bool is_failing_ = false;
};

}  // namespace gyre
