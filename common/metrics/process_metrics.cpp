// SPDX-License-Identifier: Apache-2.0
#include "common/metrics/metrics.h"
#include "common/metrics/process_usage.h"

#include <chrono>
#include <filesystem>

namespace gyre {

namespace {

double open_files() {
  std::error_code error;
  double count = 0;
  for (auto it = std::filesystem::directory_iterator("/proc/self/fd", error);
       !error && it != std::filesystem::directory_iterator(); it.increment(error)) {
    ++count;
  }
  return count;
}

}  // namespace

void add_process_metrics(Metrics& metrics) {
  const double started = std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
  metrics.gauge("gyre_build_info", "The version that runs; always 1.", [] {
    return std::vector<MetricSample>{{{{"version", GYRE_VERSION}}, 1.0}};
  });
  metrics.gauge("process_start_time_seconds", "When the program started, in seconds since 1970.",
                [started] { return started; });
  metrics.counter("process_cpu_seconds_total", "Processor time of this process, user and system, in seconds.",
                  processor_seconds);
  metrics.gauge("process_resident_memory_bytes", "Memory of this process, in bytes.", resident_bytes);
  metrics.gauge("process_open_fds", "Open file descriptors.", open_files);
}

}  // namespace gyre
