// SPDX-License-Identifier: Apache-2.0
#include "common/metrics/process_usage.h"

#include <sys/resource.h>
#include <unistd.h>
#include <fstream>
#include <string>

namespace gyre {

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

// Not getrusage's, which begins with what the process was before it became this program.
double peak_resident_bytes() {
  constexpr double kib = 1024;
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    double peak = 0;
    if (word == "VmHWM:" && status >> peak) return kib * peak;
  }
  return 0;
}

}  // namespace gyre
