// SPDX-License-Identifier: Apache-2.0
#include "device/uplink/notices.h"

#include <tuple>

namespace gyre {

namespace {

constexpr std::chrono::milliseconds between_statuses{500};
constexpr std::chrono::milliseconds between_previews{250};
// Room on the disk changes all the time; this much is news.
constexpr std::uint64_t room_step = 64 << 20;

bool same(const wire::DeviceStatus& a, const wire::DeviceStatus& b) {
  const auto key = [](const wire::DeviceStatus& s) {
    return std::tuple(s.state, s.text, s.scan, s.free_bytes / room_step, s.waiting_scans, s.waiting_files);
  };
  return key(a) == key(b);
}

}  // namespace

void Notices::set(std::string state, std::string text, std::string scan) {
  const std::lock_guard lock(mutex_);
  status_.state = std::move(state);
  status_.text = std::move(text);
  status_.scan = std::move(scan);
}

void Notices::publish(wire::CoveragePreview preview) {
  const std::lock_guard lock(mutex_);
  preview_ = std::move(preview);
  preview_is_new_ = true;
}

void Notices::restart(const wire::Capabilities& capabilities) {
  takes_status_ = wire::has(capabilities, wire::takes_status);
  takes_coverage_ = wire::has(capabilities, wire::takes_coverage);
  told_.reset();
  looked_.reset();
  previewed_.reset();
  const std::lock_guard lock(mutex_);
  preview_is_new_ = preview_.has_value();
}

std::optional<wire::Message> Notices::next(Time now) {
  if (takes_status_ && (!looked_ || now - *looked_ >= between_statuses)) {
    looked_ = now;
    wire::DeviceStatus status;
    {
      const std::lock_guard lock(mutex_);
      status = status_;
    }
    fill_(status);
    if (!told_ || !same(*told_, status)) {
      told_ = status;
      return status;
    }
  }
  if (takes_coverage_ && (!previewed_ || now - *previewed_ >= between_previews)) {
    const std::lock_guard lock(mutex_);
    if (!std::exchange(preview_is_new_, false)) return std::nullopt;
    previewed_ = now;
    return *preview_;
  }
  return std::nullopt;
}

}  // namespace gyre
