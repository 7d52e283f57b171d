// SPDX-License-Identifier: Apache-2.0
// What an operator of the host looks at: its parts as metrics, and whether each of them can work.
#pragma once

#include "common/http/operations.h"
#include "common/metrics/metrics.h"
#include "offload/ingest/ingest_server.h"
#include "offload/pipeline/runner.h"
#include "offload/store/retention.h"
#include "offload/store/store.h"

#include <cstdint>
#include <vector>

namespace gyre {

// All outlive what is made of them.
struct HostParts {
  const Store& store;
  const IngestServer& server;
  const Runner& runner;
  const Retention& retention;
  std::uint64_t reserve_bytes = 0;  // no new scan is taken when less is left
};

void add_host_metrics(Metrics& metrics, const HostParts& parts);

// "store": the catalogue can be read. "disk": there is room for new scans.
std::vector<HealthCheck> host_health(const HostParts& parts);

}  // namespace gyre
