// SPDX-License-Identifier: Apache-2.0
// What the link is like at the moment, for those who look from other threads: devices with what they said of
// themselves, and counts since the host started.
#pragma once

#include "common/wire/wire.h"

#include <array>
#include <atomic>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace gyre {

// Why somebody was turned away.
enum class RefusalKind { unknown_key, shut_out, protocol, malformed, not_allowed, host_fault };
inline constexpr std::array all_refusals = {RefusalKind::unknown_key, RefusalKind::shut_out,
                                            RefusalKind::protocol,    RefusalKind::malformed,
                                            RefusalKind::not_allowed, RefusalKind::host_fault};
std::string_view name_of(RefusalKind kind);  // "unknown_key"

// Since the host started; each grows by itself.
struct LinkCounts {
  using Count = std::atomic<std::uint64_t>;
  Count connections{0};        // devices welcomed
  Count reconnects{0};         // of those, devices that had been here before
  Count received_bytes{0};     // of files, those sent twice included
  Count received_files{0};     // checked, synced and catalogued
  Count received_frames{0};    // of those, keyframes
  Count resumed_files{0};      // asked for again from where they broke off
  Count damaged_files{0};      // whose bytes did not have their hash
  Count sent_bytes{0};         // of results
  Count dropped_messages{0};   // that could not be handed to their device
  Count failed_handshakes{0};  // connections that never became a device's
  std::array<Count, all_refusals.size()> refusals{};

  void refused(RefusalKind kind) { ++refusals[static_cast<std::size_t>(kind)]; }
};

struct DeviceView {
  std::string key, name;
  bool connected = false;
  std::string since;  // it is connected or not, UTC
  wire::Capabilities capabilities;
  std::optional<wire::DeviceStatus> status;       // the last it told
  std::optional<wire::CoveragePreview> coverage;  // of the scan it records, or recorded last
};

// All methods may be called from any thread.
class LinkBoard {
 public:
  LinkCounts counts;

  void arrived(const std::string& key, const wire::Hello& hello);
  void left(const std::string& key);
  void shut_out(const std::string& key);  // what it told of itself is forgotten
  void told(const std::string& key, const wire::DeviceStatus& status);
  void told(const std::string& key, const wire::CoveragePreview& preview);

  std::vector<DeviceView> devices() const;  // by name
  std::optional<DeviceView> device(const std::string& key) const;

 private:
  mutable std::mutex mutex_;
  std::map<std::string, DeviceView> devices_;  // by key
};

}  // namespace gyre
