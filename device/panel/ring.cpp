// SPDX-License-Identifier: Apache-2.0
#include "device/panel/ring.h"

#include <cmath>

namespace gyre {

namespace {

Rgb light_of(const CellStatus& cell) {
  constexpr double blurred = 0.25;
  constexpr double dimmest = 0.3;  // of what is covered
  if (cell.is_covered) return dimmed(rgb_of(Colour::green), dimmest + (1.0 - dimmest) * cell.quality);
  if (cell.is_seen) return dimmed(rgb_of(Colour::yellow), blurred);
  return {};
}

}  // namespace

std::vector<Rgb> ring_of(const LiveStatus& status, double level, int count) {
  std::vector<Rgb> lights(static_cast<std::size_t>(count), dimmed(rgb_of(status.signal.colour), level));
  if (status.state != SessionState::pass || count == 0) return lights;
  const auto& cells = status.cells[static_cast<std::size_t>(status.band)];
  for (int i = 0; i < count; ++i) {
    lights[static_cast<std::size_t>(i)] = light_of(cells[static_cast<std::size_t>(i * CoverageMap::sectors / count)]);
  }
  if (status.azimuth) {
    const double turns = *status.azimuth / (2.0 * M_PI);
    const int at = std::min(count - 1, static_cast<int>((turns - std::floor(turns)) * count));
    lights[static_cast<std::size_t>(at)] = rgb_of(Colour::white);
  }
  return lights;
}

std::vector<std::uint8_t> ws2812_bytes(std::span<const Rgb> lights) {
  constexpr std::size_t bytes_per_light = 9;
  constexpr std::size_t pause = 90;  // bytes: 300 us
  std::vector<std::uint8_t> bytes;
  bytes.reserve(lights.size() * bytes_per_light + pause);
  for (const Rgb& light : lights) {
    for (const std::uint8_t value : {light.green, light.red, light.blue}) {
      std::uint32_t wire = 0;  // a one is 110, a zero 100
      for (int bit = 7; bit >= 0; --bit) wire = (wire << 3) | (((value >> bit) & 1) != 0 ? 0b110U : 0b100U);
      for (const int shift : {16, 8, 0}) bytes.push_back(static_cast<std::uint8_t>(wire >> shift));
    }
  }
  bytes.resize(bytes.size() + pause, 0);
  return bytes;
}

}  // namespace gyre
