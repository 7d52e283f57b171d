// SPDX-License-Identifier: Apache-2.0
#include "common/service/service_report.h"

#include <spdlog/spdlog.h>

namespace gyre {

void ServiceReport::beat(std::string_view status, Clock::time_point now) {
  if (!manager_.is_there()) return;
  if (!status_) check(manager_.ready());
  if (status_ != status) {
    status_ = status;
    check(manager_.status(status));
  }
  const auto watchdog = manager_.watchdog();
  if (!watchdog || (alive_at_ && now - *alive_at_ < *watchdog / 4)) return;
  alive_at_ = now;
  check(manager_.alive());
}

void ServiceReport::check(const Result<void>& told) {
  if (!told && !is_failing_) spdlog::warn("{}", told.error().message());
  is_failing_ = !told;
}

}  // namespace gyre
