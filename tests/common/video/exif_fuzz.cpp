// SPDX-License-Identifier: Apache-2.0
#include "common/video/exif.h"
#include "tests/fuzz/fuzz.h"

#include <cstdlib>

// Any bytes have an orientation, and a focal length that is none or positive.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const gyre::ExifFacts facts = gyre::read_exif(std::as_bytes(std::span(data, size)));
  const auto orientation = static_cast<int>(facts.orientation);
  if (orientation < 1 || orientation > 8) std::abort();
  if (facts.focal_35mm && !(*facts.focal_35mm > 0)) std::abort();
  return 0;
}
