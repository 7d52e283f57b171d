// SPDX-License-Identifier: Apache-2.0
// A ring of WS2812 lights that shows the coverage of the pass around the subject.
#pragma once

#include "device/panel/shine.h"
#include "device/session/live_status.h"

#include <cstdint>
#include <span>
#include <vector>

namespace gyre {

// What each of `count` lights shows. While a pass is on, light 0 is the sector where it began, counter-clockwise seen
// from above, of the band the camera is in: green where it was seen sharply, dim yellow where only blurred, dark where
// not at all, white where the camera is. Otherwise all show the signal. level: of the signal's pattern, 0 to 1.
std::vector<Rgb> ring_of(const LiveStatus& status, double level, int count);

// The bytes for MOSI at `ws2812_hertz`: three bits on the wire for each bit of a colour, green first, and a pause
// after which the lights take them over (WS2812B data sheet, 300 us).
inline constexpr int ws2812_hertz = 2'400'000;
std::vector<std::uint8_t> ws2812_bytes(std::span<const Rgb> lights);

}  // namespace gyre
