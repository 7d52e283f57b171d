// SPDX-License-Identifier: Apache-2.0
// Signals as light and sound over time. Pure.
#pragma once

#include "device/guidance/guidance.h"

#include <cstdint>

namespace gyre {

struct Rgb {
  std::uint8_t red = 0, green = 0, blue = 0;
  bool operator==(const Rgb&) const = default;
};

Rgb rgb_of(Colour colour);

// The same colour, darker. level: 0 to 1.
Rgb dimmed(Rgb colour, double level);

// How bright a pattern is, 0 to 1, `time` seconds after it began.
double level_of(Pattern pattern, double time);

// What a tone sounds like `time` seconds after it began, Hz; 0: silence, and for ever when it is over.
double frequency_of(Tone tone, double time);

}  // namespace gyre
