// SPDX-License-Identifier: Apache-2.0
// What the host is told of the session while it goes on.
#pragma once

#include "device/session/live_status.h"
#include "device/uplink/uplink.h"

#include <string>

namespace gyre {

// Hands on what has changed. Belongs to one thread; the uplink outlives it.
class HostNotices {
 public:
  explicit HostNotices(Uplink& uplink) : uplink_(uplink) {}

  void show(const LiveStatus& status);

 private:
  Uplink& uplink_;
  std::string told_;            // state, sentence and scan
  wire::CoveragePreview seen_;  // cells that were told
};

}  // namespace gyre
