// SPDX-License-Identifier: Apache-2.0
// The scans of a fault run: what is in each follows from its number.
#pragma once

#include "common/bundle/bundle.h"
#include "common/result/result.h"
#include "tests/device/spool/scan_support.h"

#include <cstddef>
#include <string>
#include <vector>

namespace gyre {

constexpr int fault_frames = 8;  // candidates of a scan

// Every fourth is taken back by the selection.
constexpr bool is_fault_keyframe(int frame) {
  return frame % 4 != 3;
}
std::vector<int> fault_keyframes();

Scan fault_scan(int number);
std::vector<std::byte> fault_frame(int number, int frame);

// What the host makes of a bundle: depends on every byte of every file in it.
Result<std::string> fault_avatar(const Bundle& bundle);

}  // namespace gyre
