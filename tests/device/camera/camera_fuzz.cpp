// SPDX-License-Identifier: Apache-2.0
#include "device/camera/camera_name.h"
#include "device/camera/fault_script.h"
#include "device/camera/jpeg.h"
#include "device/camera/jpeg_extent.h"
#include "tests/fuzz/fuzz.h"

#include <cstdlib>

// Any text is a name, a script, a picture or an error; a name is written as something that reads the same, and of a
// picture what follows it does not count.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  if (const auto name = gyre::parse_camera_name(text)) {
    const std::string written = to_string(*name);
    const auto again = gyre::parse_camera_name(written);
    if (!again || to_string(*again) != written) std::abort();
  }
  if (const auto faults = gyre::parse_fault_script(text)) {
    for (std::size_t i = 1; i < faults->size(); ++i) {
      if ((*faults)[i].before_frame <= (*faults)[i - 1].before_frame) std::abort();
    }
  }
  const std::string_view picture = gyre::jpeg_extent(text);
  if (!text.starts_with(picture) || gyre::jpeg_extent(picture) != picture) std::abort();
  constexpr int most_pixels = 1 << 20;
  const auto size_told = gyre::jpeg_size(picture);
  if (size_told && size_told->area() <= most_pixels) (void)gyre::decode_jpeg(picture, 1);
  return 0;
}
