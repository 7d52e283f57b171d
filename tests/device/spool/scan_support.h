// SPDX-License-Identifier: Apache-2.0
// Small scans for the tests of the link: pictures that decode, records that match them, folders that go away.
#pragma once

#include "common/bundle/bundle.h"
#include "device/spool/spool.h"
#include "tests/temporary_folder.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace gyre {

// A scan with one pass "body" and a new id.
Scan small_scan();

// A JPEG of 16 x 16 pixels followed by noise up to `size` bytes: decodes, does not compress, differs for every seed.
std::vector<std::byte> small_keyframe(std::uint64_t seed, std::size_t size);

// "frames/body-<index>.jpg"
std::string keyframe_name(int index);

// Records of `count` frames of pass body, of which `keyframes` are chosen.
std::vector<FrameRecord> small_records(int count, const std::vector<int>& keyframes);

// Spools a whole scan: keyframe i has small_keyframe(seed + i, size).
Result<void> spool_scan(Spool& spool, const Scan& scan, const std::vector<int>& keyframes, std::size_t size,
                        std::uint64_t seed);

// Waits until `condition` holds, for 60 seconds at most; false when it does not come true. For other threads' work.
bool eventually(const std::function<bool()>& condition);

}  // namespace gyre
