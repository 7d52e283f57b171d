// SPDX-License-Identifier: Apache-2.0
// A device of link_bench: spool and uplink and nothing else, so that its memory is what the link takes of a board.
//
//   link_device FOLDER ENDPOINT HOST_KEY SCANS KEYFRAMES BYTES
//
// Says "ready" on stdout when its first scan is spooled, starts at a line on stdin, and says what it measured.
#include "common/metrics/process_usage.h"
#include "device/uplink/uplink.h"
#include "tests/device/spool/scan_support.h"

#include <spdlog/spdlog.h>
#include <unistd.h>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <numeric>

namespace gyre {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using Clock = std::chrono::steady_clock;

constexpr useconds_t look_again_us = 1000;
constexpr double mib = 1 << 20;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

template <class T>
T must(Result<T> result) {
  if (!result) {
    std::fprintf(stderr, "link_device: %s\n", result.error().message().c_str());
    std::_Exit(1);
  }
  if constexpr (!std::is_void_v<T>) return std::move(*result);
}

struct Work {
  int scans = 1;       // one: spooled before the start
  int keyframes = 10;  // of each scan
  std::size_t bytes = 2 << 20;
};

// Time from a keyframe being spooled to its acknowledgement, milliseconds, of every keyframe of a scan.
std::vector<double> follow(Spool& spool, const Scan& scan, const std::vector<Clock::time_point>& spooled) {
  std::vector<double> waits(spooled.size(), -1.0);
  while (true) {
    const SpooledScan now = *spool.scan(scan.id);
    for (std::size_t i = 0; i < spooled.size(); ++i) {
      const SpooledFile* file = find_file(now.files, keyframe_name(static_cast<int>(i)));
      if (waits[i] < 0 && file->phase == SpooledFilePhase::acknowledged) waits[i] = 1000.0 * seconds_since(spooled[i]);
    }
    if (now.phase == SpoolPhase::acknowledged) return waits;
    ::usleep(look_again_us);
  }
}

int device(const fs::path& folder, const std::string& endpoint, const std::string& host_key, const Work& work) {
  const auto spool = must(Spool::open(folder / "spool"));
  UplinkOptions options;
  options.host = endpoint;
  options.host_public_key = host_key;
  options.keys = must(read_key_pair(folder / "device.key"));
  options.device_name = folder.filename().string();
  must(options.check());

  std::vector<int> indices(static_cast<std::size_t>(work.keyframes));
  std::iota(indices.begin(), indices.end(), 0);
  const auto seed = std::hash<std::string>{}(options.device_name);
  Scan scan = small_scan();
  if (work.scans == 1) must(spool_scan(*spool, scan, indices, work.bytes, seed));
  std::puts("ready");
  std::fflush(stdout);
  std::getchar();

  const Clock::time_point start = Clock::now();
  const double before = processor_seconds();
  Uplink uplink(options, *spool);
  std::vector<double> waits;
  double early = resident_bytes();
  for (int i = 0; i < work.scans; ++i) {
    if (i == work.scans / 5) early = resident_bytes();
    if (work.scans > 1) {
      scan = small_scan();
      must(spool->open_scan(scan));
      std::vector<Clock::time_point> spooled;
      for (const int index : indices) {
        const auto picture = small_keyframe(seed + static_cast<std::uint64_t>(i * work.keyframes + index), work.bytes);
        must(spool->add_file(scan.id, keyframe_name(index), picture));
        spooled.push_back(Clock::now());
      }
      must(spool->close_scan(scan, small_records(work.keyframes, indices)));
      const std::vector<double> of_scan = follow(*spool, scan, spooled);
      waits.insert(waits.end(), of_scan.begin(), of_scan.end());
    } else {
      while (spool->phase(scan.id) != SpoolPhase::acknowledged) ::usleep(look_again_us);
    }
  }
  std::printf("%s\n", json{{"seconds", seconds_since(start)},
                           {"memory_mib", peak_resident_bytes() / mib},
                           {"memory_growth_mib", (resident_bytes() - early) / mib},
                           {"cpu_seconds", processor_seconds() - before},
                           {"waits_ms", waits}}
                          .dump()
                          .c_str());
  return 0;
}

}  // namespace
}  // namespace gyre

int main(int argc, char** argv) {
  spdlog::set_level(spdlog::level::warn);
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() == 6) {
    return gyre::device(words[0], words[1], words[2], {std::stoi(words[3]), std::stoi(words[4]), std::stoul(words[5])});
  }
  std::fputs("usage: link_device FOLDER ENDPOINT HOST_KEY SCANS KEYFRAMES BYTES\n", stderr);
  return 2;
}
