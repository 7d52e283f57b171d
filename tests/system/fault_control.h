// SPDX-License-Identifier: Apache-2.0
// What a test does to a program it has started with fault_shim.so loaded before everything else: a file that both map.
#pragma once

#include <atomic>
#include <cstdint>

namespace gyre {

constexpr const char* fault_control_variable = "GYRE_FAULT_CONTROL";  // names the file

struct FaultControl {
  std::atomic<int> disk_full{0};                // nothing more can be written to any file
  std::atomic<std::int64_t> clock_offset_s{0};  // of the time of day
};

}  // namespace gyre
