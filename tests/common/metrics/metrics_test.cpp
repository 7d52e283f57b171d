// SPDX-License-Identifier: Apache-2.0
#include "common/metrics/metrics.h"

#include <gtest/gtest.h>
#include <limits>
#include <sstream>

namespace gyre {
namespace {

TEST(Metrics, ToldInTheOrderAdded) {
  Metrics metrics;
  double bytes = 3;
  metrics.counter("gyre_received_bytes_total", "Bytes received.", [&] { return bytes; });
  metrics.gauge("gyre_scans", "Scans.", [] {
    return std::vector<MetricSample>{{{{"phase", "done"}}, 2}, {{{"phase", "failed"}, {"device", "rig"}}, 0.5}};
  });
  const std::string expected =
      "# HELP gyre_received_bytes_total Bytes received.\n"
      "# TYPE gyre_received_bytes_total counter\n"
      "gyre_received_bytes_total 3\n"
      "# HELP gyre_scans Scans.\n"
      "# TYPE gyre_scans gauge\n"
      "gyre_scans{phase=\"done\"} 2\n"
      "gyre_scans{phase=\"failed\",device=\"rig\"} 0.5\n";
  EXPECT_EQ(metrics.expose(), expected);
  bytes = 1e12;
  EXPECT_NE(metrics.expose().find("gyre_received_bytes_total 1e+12\n"), std::string::npos);
}

TEST(Metrics, AnyTextMayBeAValueOfALabel) {
  Metrics metrics;
  metrics.gauge("g", "a \"line\" with \\ and\nanother", [] {
    return std::vector<MetricSample>{{{{"text", "a \"line\" with \\ and\nanother"}}, 1}};
  });
  EXPECT_EQ(metrics.expose(),
            "# HELP g a \"line\" with \\\\ and\\nanother\n# TYPE g gauge\n"
            "g{text=\"a \\\"line\\\" with \\\\ and\\nanother\"} 1\n");
}

TEST(Metrics, NumbersThatAreNone) {
  Metrics metrics;
  using Limits = std::numeric_limits<double>;
  for (const double value : {Limits::quiet_NaN(), Limits::infinity(), -Limits::infinity()}) {
    metrics.gauge("g", "h", [value] { return value; });
  }
  const std::string text = metrics.expose();
  for (const char* line : {"g NaN\n", "g +Inf\n", "g -Inf\n"}) EXPECT_NE(text.find(line), std::string::npos) << line;
}

TEST(Metrics, AFamilyWithoutSamplesIsNamedAll) {
  Metrics metrics;
  metrics.counter("c_total", "h", [] { return std::vector<MetricSample>(); });
  EXPECT_EQ(metrics.expose(), "# HELP c_total h\n# TYPE c_total counter\n");
}

TEST(Metrics, TheProcessTellsOfItself) {
  Metrics metrics;
  add_process_metrics(metrics);
  std::istringstream lines(metrics.expose());
  std::map<std::string, double> values;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with('#')) continue;
    const std::size_t space = line.rfind(' ');
    values[line.substr(0, space)] = std::stod(line.substr(space + 1));
  }
  EXPECT_EQ(values.at("gyre_build_info{version=\"" GYRE_VERSION "\"}"), 1);
  EXPECT_GT(values.at("process_resident_memory_bytes"), 1e6);
  EXPECT_GE(values.at("process_open_fds"), 3);
  EXPECT_GT(values.at("process_start_time_seconds"), 1.7e9);
}

}  // namespace
}  // namespace gyre
