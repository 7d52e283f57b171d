// SPDX-License-Identifier: Apache-2.0
#include "common/metrics/metrics.h"

#include <sys/resource.h>
#include <unistd.h>
#include <chrono>
#include <filesystem>
#include <fstream>

namespace gyre {

namespace {

double processor_seconds() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

// The second number of statm: resident pages.
double resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  double size = 0;
  double resident = 0;
  statm >> size >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE));
}

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
