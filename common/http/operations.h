// SPDX-License-Identifier: Apache-2.0
// What those who run a program look at: its metrics, and whether it is well.
#pragma once

#include "common/http/http_server.h"
#include "common/metrics/metrics.h"

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace gyre {

// One thing without which the program cannot do its work.
struct HealthCheck {
  std::string name;
  std::function<std::optional<std::string>()> fault;  // what is wrong, if anything
};

// GET /metrics, for Prometheus, and GET /health: {"status": "ok" or "failing", "checks": {name: "ok" or what is
// wrong}}, with 503 when anything is. Before start(); metrics outlives the server.
void add_operations_routes(HttpServer& server, const Metrics& metrics, std::vector<HealthCheck> checks);

}  // namespace gyre
