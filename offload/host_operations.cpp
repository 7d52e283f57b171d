// SPDX-License-Identifier: Apache-2.0
#include "offload/host_operations.h"

#include "common/bundle/disk_space.h"

#include <array>

namespace gyre {

namespace {

using Samples = std::vector<MetricSample>;

Samples scans_by_phase(const Store& store) {
  constexpr std::array phases = {StorePhase::receiving, StorePhase::queued, StorePhase::running, StorePhase::done,
                                 StorePhase::failed};
  std::array<double, phases.size()> counts{};
  for (const StoredScan& scan : store.scans().value_or(std::vector<StoredScan>())) {
    ++counts.at(static_cast<std::size_t>(scan.phase));
  }
  Samples samples;
  for (const StorePhase phase : phases) {
    samples.push_back({{{"phase", std::string(name_of(phase))}}, counts.at(static_cast<std::size_t>(phase))});
  }
  return samples;
}

template <class Value>
Samples samples_by(const char* label, const std::map<std::string, Value>& values) {
  Samples samples;
  for (const auto& [name, value] : values) samples.push_back({{{label, name}}, static_cast<double>(value)});
  return samples;
}

Samples refusals(const LinkCounts& counts) {
  Samples samples;
  for (const RefusalKind kind : all_refusals) {
    samples.push_back({{{"reason", std::string(name_of(kind))}},
                       static_cast<double>(counts.refusals.at(static_cast<std::size_t>(kind)).load())});
  }
  return samples;
}

// Of every device that has told its status.
Samples of_devices(const LinkBoard& board, double (*value)(const wire::DeviceStatus&)) {
  Samples samples;
  for (const DeviceView& device : board.devices()) {
    if (device.status) samples.push_back({{{"device", device.name}}, value(*device.status)});
  }
  return samples;
}

double connected(const LinkBoard& board) {
  double count = 0;
  for (const DeviceView& device : board.devices()) count += device.connected ? 1 : 0;
  return count;
}

void add_link_metrics(Metrics& metrics, const LinkBoard& board) {
  const LinkCounts& counts = board.counts;
  const auto count = [&](const char* name, const char* help, const LinkCounts::Count& value) {
    metrics.counter(name, help, [&value] { return static_cast<double>(value.load()); });
  };
  metrics.gauge("gyre_devices_connected", "Devices that are connected.", [&board] { return connected(board); });
  count("gyre_connections_total", "Times that a device was welcomed.", counts.connections);
  count("gyre_reconnects_total", "Of those, by a device that had been here before.", counts.reconnects);
  count("gyre_received_bytes_total", "Bytes of files received, those sent twice included.", counts.received_bytes);
  count("gyre_received_files_total", "Files received whole and stored.", counts.received_files);
  count("gyre_received_frames_total", "Of those, keyframes.", counts.received_frames);
  count("gyre_resumed_files_total", "Files asked for again from where they broke off.", counts.resumed_files);
  count("gyre_damaged_files_total", "Files whose bytes did not have their hash.", counts.damaged_files);
  count("gyre_sent_bytes_total", "Bytes of results sent.", counts.sent_bytes);
  count("gyre_dropped_messages_total", "Messages that could not be handed to their device.", counts.dropped_messages);
  count("gyre_failed_handshakes_total", "Connections that never became a device's.", counts.failed_handshakes);
  metrics.counter("gyre_refusals_total", "Devices and messages turned away.", [&counts] { return refusals(counts); });
  metrics.gauge("gyre_device_free_bytes", "Room left on the disk of a device.", [&board] {
    return of_devices(board, [](const wire::DeviceStatus& s) { return static_cast<double>(s.free_bytes); });
  });
  metrics.gauge("gyre_device_waiting_files", "Files that a device has and the host does not.", [&board] {
    return of_devices(board, [](const wire::DeviceStatus& s) { return static_cast<double>(s.waiting_files); });
  });
}

void add_runner_metrics(Metrics& metrics, const Runner& runner) {
  metrics.counter("gyre_jobs_ended_total", "Jobs that ended, by how.", [&runner] {
    const RunnerTally tally = runner.tally();
    return samples_by<std::uint64_t>(
        "how", {{"finished", tally.finished}, {"failed", tally.failed}, {"cancelled", tally.cancelled}});
  });
  metrics.counter("gyre_job_retries_total", "Jobs put back to be tried again, by cause.",
                  [&runner] { return samples_by("cause", runner.tally().retries); });
  metrics.counter("gyre_stage_runs_total", "Stages run, of finished jobs.",
                  [&runner] { return samples_by("stage", runner.tally().stage_runs); });
  metrics.counter("gyre_stage_seconds_total", "Wall time of those, in seconds.",
                  [&runner] { return samples_by("stage", runner.tally().stage_seconds); });
}

}  // namespace

void add_host_metrics(Metrics& metrics, const HostParts& parts) {
  add_process_metrics(metrics);
  metrics.gauge("gyre_scans", "Scans in the store; those queued wait for their turn.",
                [&store = parts.store] { return scans_by_phase(store); });
  metrics.gauge("gyre_store_free_bytes", "Room left on the store's disk.",
                [&store = parts.store] { return static_cast<double>(free_bytes(store.folder()).value_or(0)); });
  metrics.gauge("gyre_store_reserve_bytes", "Room below which no new scan is taken.",
                [reserve = parts.reserve_bytes] { return static_cast<double>(reserve); });
  metrics.counter("gyre_retention_deleted_total", "Scans deleted by the retention policy.",
                  [&retention = parts.retention] { return static_cast<double>(retention.deleted()); });
  add_link_metrics(metrics, parts.server.board());
  add_runner_metrics(metrics, parts.runner);
}

std::vector<HealthCheck> host_health(const HostParts& parts) {
  const auto store = [&store = parts.store]() -> std::optional<std::string> {
    const Result<std::vector<StoredScan>> scans = store.scans();
    return scans ? std::nullopt : std::optional(scans.error().message());
  };
  const auto disk = [&store = parts.store, reserve = parts.reserve_bytes]() -> std::optional<std::string> {
    const Result<std::uint64_t> left = free_bytes(store.folder());
    if (!left) return left.error().message();
    if (*left >= reserve) return std::nullopt;
    return "nearly full, no new scan is taken: " + std::to_string(*left >> 20) + " MiB left";
  };
  return {{"store", store}, {"disk", disk}};
}

}  // namespace gyre
