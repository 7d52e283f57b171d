// SPDX-License-Identifier: Apache-2.0
#include "device/session/host_watch.h"

namespace gyre {

std::optional<HostNews> HostWatch::look(double now, const std::optional<Scan>& scan, bool is_waited_for) {
  constexpr double every = 0.25;
  if (now - looked_at_ < every) return std::nullopt;
  looked_at_ = now;
  const std::optional<SpooledScan> spooled = scan ? spool_.scan(scan->id) : std::nullopt;
  count(spooled);
  if (uplink_ == nullptr) return std::nullopt;
  const LinkStatus link = uplink_->status();
  status_ = {.is_wanted = true, .is_connected = link.phase == LinkStatus::Phase::connected, .text = link.text};
  is_there_ = status_.is_connected || link.phase == LinkStatus::Phase::connecting;
  if (!is_waited_for || !scan) return std::nullopt;
  return news_of(scan->id, spooled);
}

void HostWatch::count(const std::optional<SpooledScan>& scan) {
  keyframes_ = acknowledged_ = 0;
  if (!scan) return;
  for (const SpooledFile& file : scan->files) {
    if (file.phase == SpooledFilePhase::discarded || !file.name.starts_with("frames/")) continue;
    ++keyframes_;
    if (file.phase == SpooledFilePhase::acknowledged) ++acknowledged_;
  }
}

std::optional<HostNews> HostWatch::news_of(const std::string& id, const std::optional<SpooledScan>& scan) {
  if (!scan) return HostNews{SessionEvent::cancel, "scan " + id + " is no longer in the spool"};
  const ScanProgress progress = uplink_->progress(id);
  status_.stage = progress.stage;
  status_.fraction = progress.fraction;
  if (!progress.text.empty()) status_.text = progress.text;
  if (scan->phase == SpoolPhase::delivered) {
    return HostNews{SessionEvent::avatar_received, "the avatar of scan " + id + " is here"};
  }
  if (scan->phase == SpoolPhase::failed) {
    return HostNews{SessionEvent::reconstruction_failed,
                    "the host could not reconstruct scan " + id + ": " + scan->reason};
  }
  if (progress.stage == "refused") {
    return HostNews{SessionEvent::reconstruction_failed, "the host does not take scan " + id + ": " + progress.text};
  }
  if (scan->phase == SpoolPhase::acknowledged) return HostNews{SessionEvent::all_acknowledged, {}};
  return std::nullopt;
}

}  // namespace gyre
