// SPDX-License-Identifier: Apache-2.0
// What the session knows of the host: whether it answers, and what has become of a scan there.
#pragma once

#include "device/session/live_status.h"
#include "device/spool/spool.h"
#include "device/uplink/uplink.h"

#include <optional>
#include <string>

namespace gyre {

struct HostNews {
  SessionEvent event = SessionEvent::all_acknowledged;
  std::string text;  // for the operator
};

// Belongs to one thread.
class HostWatch {
 public:
  // uplink: null when scans stay here. Both outlive this.
  HostWatch(const Spool& spool, const Uplink* uplink) : spool_(spool), uplink_(uplink) {}

  bool is_wanted() const { return uplink_ != nullptr; }
  bool is_there() const { return is_there_; }  // or may come any moment, or none is wanted
  const HostStatus& status() const { return status_; }
  int keyframes() const { return keyframes_; }  // of the scan, in the spool
  int acknowledged() const { return acknowledged_; }

  // Looks, four times a second. scan: that is open, waited for or shown; is_waited_for: news of it are wanted.
  std::optional<HostNews> look(double now, const std::optional<Scan>& scan, bool is_waited_for);

 private:
  void count(const std::optional<SpooledScan>& scan);
  std::optional<HostNews> news_of(const std::string& id, const std::optional<SpooledScan>& scan);

  const Spool& spool_;
  const Uplink* uplink_;
  double looked_at_ = -1e9;  // seconds
  bool is_there_ = true;
  HostStatus status_;
  int keyframes_ = 0, acknowledged_ = 0;
};

}  // namespace gyre
