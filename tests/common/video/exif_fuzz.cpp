// SPDX-License-Identifier: Apache-2.0
#include "common/video/exif.h"
#include "tests/fuzz/fuzz.h"

#include <cstdlib>

// Any bytes have an orientation.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto orientation = static_cast<int>(gyre::exif_orientation(std::as_bytes(std::span(data, size))));
  if (orientation < 1 || orientation > 8) std::abort();
  return 0;
}
