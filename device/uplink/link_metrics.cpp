// SPDX-License-Identifier: Apache-2.0
#include "device/uplink/link_metrics.h"

#include "common/bundle/disk_space.h"

namespace gyre {

namespace {

Metrics::ReadOne value_of(const std::atomic<std::uint64_t>& count) {
  return [&count] { return static_cast<double>(count.load()); };
}

}  // namespace

void add_link_metrics(Metrics& metrics, const Spool& spool, const Uplink* uplink) {
  const SpoolCounts& spooled = spool.counts();
  metrics.gauge("gyre_spool_scans", "Scans that the host does not have whole.",
                [&spool] { return static_cast<double>(spool.waiting().scans); });
  metrics.gauge("gyre_spool_waiting_files", "Files of those that the host does not have.",
                [&spool] { return static_cast<double>(spool.waiting().files); });
  metrics.gauge("gyre_spool_waiting_bytes", "Bytes of those files.",
                [&spool] { return static_cast<double>(spool.waiting().bytes); });
  metrics.gauge("gyre_spool_free_bytes", "Room left on the spool's disk.",
                [&spool] { return static_cast<double>(free_bytes(spool.folder()).value_or(0)); });
  metrics.counter("gyre_spooled_frames_total", "Keyframes put into the spool.", value_of(spooled.frames));
  metrics.counter("gyre_spooled_bytes_total", "Bytes put into the spool.", value_of(spooled.bytes));
  metrics.counter("gyre_dropped_frames_total", "Keyframes that the selection took back.", value_of(spooled.discarded));
  metrics.counter("gyre_full_disk_total", "Times that the spool's disk had no room.", value_of(spooled.no_room));
  if (uplink == nullptr) return;
  const UplinkCounts& sent = uplink->counts();
  metrics.gauge("gyre_uplink_connected", "1 while the host answers.",
                [uplink] { return uplink->status().phase == LinkStatus::Phase::connected ? 1.0 : 0.0; });
  metrics.counter("gyre_uplink_connections_total", "Times that the host welcomed this device.",
                  value_of(sent.connections));
  metrics.counter("gyre_uplink_lost_total", "Connections that ended, or did not come about.", value_of(sent.lost));
  metrics.counter("gyre_uplink_refused_total", "Times that the host refused this device.", value_of(sent.refused));
  metrics.counter("gyre_sent_bytes_total", "Bytes of files sent, those sent again included.", value_of(sent.bytes));
  metrics.counter("gyre_acknowledged_files_total", "Files that the host said it has.",
                  value_of(sent.acknowledged_files));
  metrics.counter("gyre_resumed_files_total", "Files that the host asked for again.", value_of(sent.resumed_files));
  metrics.counter("gyre_result_bytes_total", "Bytes of results received.", value_of(sent.result_bytes));
}

}  // namespace gyre
