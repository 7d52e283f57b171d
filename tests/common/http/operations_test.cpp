// SPDX-License-Identifier: Apache-2.0
#include "common/http/operations.h"

#include <gtest/gtest.h>
#include <httplib.h>
#include <nlohmann/json.hpp>

namespace gyre {
namespace {

using nlohmann::json;

TEST(Operations, MetricsAndHealthAreServed) {
  Metrics metrics;
  metrics.gauge("gyre_scans", "Scans.", [] { return 3.0; });
  std::optional<std::string> fault;
  HttpServer server(HttpOptions{});
  add_operations_routes(server, metrics, {{"disk", [&] { return fault; }}, {"store", [] { return std::nullopt; }}});
  ASSERT_TRUE(server.start());
  httplib::Client client("127.0.0.1", server.port());

  const auto told = client.Get("/metrics");
  ASSERT_EQ(told->status, 200);
  EXPECT_EQ(told->get_header_value("Content-Type"), Metrics::content_type);
  EXPECT_EQ(told->body, metrics.expose());

  const auto well = client.Get("/health");
  EXPECT_EQ(well->status, 200);
  EXPECT_EQ(json::parse(well->body), json({{"status", "ok"}, {"checks", {{"disk", "ok"}, {"store", "ok"}}}}));
  fault = "nearly full";
  const auto ill = client.Get("/health");
  EXPECT_EQ(ill->status, 503);
  EXPECT_EQ(json::parse(ill->body).at("status"), "failing");
  EXPECT_EQ(json::parse(ill->body).at("checks").at("disk"), "nearly full");
  // A page of another site that points its name here does not get in.
  EXPECT_EQ(client.Get("/metrics", {{"Host", "example.org"}})->status, 403);
}

}  // namespace
}  // namespace gyre
