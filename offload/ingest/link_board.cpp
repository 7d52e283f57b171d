// SPDX-License-Identifier: Apache-2.0
#include "offload/ingest/link_board.h"

#include "common/log/utc_time.h"

#include <algorithm>

namespace gyre {

std::string_view name_of(RefusalKind kind) {
  switch (kind) {
    case RefusalKind::unknown_key:
      return "unknown_key";
    case RefusalKind::shut_out:
      return "shut_out";
    case RefusalKind::protocol:
      return "protocol";
    case RefusalKind::malformed:
      return "malformed";
    case RefusalKind::not_allowed:
      return "not_allowed";
    case RefusalKind::host_fault:
      break;
  }
  return "host_fault";
}

void LinkBoard::arrived(const std::string& key, const wire::Hello& hello) {
  ++counts.connections;
  const std::lock_guard lock(mutex_);
  const auto [place, is_new] = devices_.try_emplace(key);
  if (!is_new) ++counts.reconnects;
  DeviceView& device = place->second;
  device.key = key;
  device.name = hello.device_name;
  device.connected = true;
  device.since = utc_now();
  device.capabilities = hello.capabilities;
}

void LinkBoard::left(const std::string& key) {
  const std::lock_guard lock(mutex_);
  const auto found = devices_.find(key);
  if (found == devices_.end() || !found->second.connected) return;
  found->second.connected = false;
  found->second.since = utc_now();
}

void LinkBoard::shut_out(const std::string& key) {
  const std::lock_guard lock(mutex_);
  devices_.erase(key);
}

void LinkBoard::told(const std::string& key, const wire::DeviceStatus& status) {
  const std::lock_guard lock(mutex_);
  const auto found = devices_.find(key);
  if (found != devices_.end()) found->second.status = status;
}

void LinkBoard::told(const std::string& key, const wire::CoveragePreview& preview) {
  const std::lock_guard lock(mutex_);
  const auto found = devices_.find(key);
  if (found != devices_.end()) found->second.coverage = preview;
}

std::vector<DeviceView> LinkBoard::devices() const {
  std::vector<DeviceView> all;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [key, device] : devices_) all.push_back(device);
  }
  std::sort(all.begin(), all.end(), [](const DeviceView& a, const DeviceView& b) { return a.name < b.name; });
  return all;
}

std::optional<DeviceView> LinkBoard::device(const std::string& key) const {
  const std::lock_guard lock(mutex_);
  const auto found = devices_.find(key);
  return found == devices_.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace gyre
