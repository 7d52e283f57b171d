// SPDX-License-Identifier: Apache-2.0
#include "common/http/operations.h"

#include <nlohmann/json.hpp>

namespace gyre {

void add_operations_routes(HttpServer& server, const Metrics& metrics, std::vector<HealthCheck> checks) {
  server.get("/metrics", [&metrics](const HttpRequest&) {
    HttpResponse response;
    response.type = Metrics::content_type;
    response.body = metrics.expose();
    return response;
  });
  server.get("/health", [checks = std::move(checks)](const HttpRequest&) {
    constexpr int unavailable = 503;
    nlohmann::json told = nlohmann::json::object();
    bool well = true;
    for (const HealthCheck& check : checks) {
      const std::optional<std::string> fault = check.fault();
      well = well && !fault;
      told[check.name] = fault.value_or("ok");
    }
    return json_response({{"status", well ? "ok" : "failing"}, {"checks", std::move(told)}}, well ? 200 : unavailable);
  });
}

}  // namespace gyre
