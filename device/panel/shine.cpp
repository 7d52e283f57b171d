// SPDX-License-Identifier: Apache-2.0
#include "device/panel/shine.h"

#include <array>
#include <cmath>
#include <span>

namespace gyre {

namespace {

struct Note {
  double frequency;  // Hz
  double seconds;
};

constexpr double low = 523.0;    // C5
constexpr double high = 1568.0;  // G6
constexpr std::array low_notes = {Note{low, 0.2}};
constexpr std::array high_notes = {Note{high, 0.2}};
constexpr std::array double_low_notes = {Note{low, 0.15}, Note{0.0, 0.1}, Note{low, 0.15}};
constexpr std::array double_high_notes = {Note{high, 0.15}, Note{0.0, 0.1}, Note{high, 0.15}};
constexpr std::array rising_notes = {Note{low, 0.12}, Note{784.0, 0.12}, Note{1047.0, 0.12}, Note{high, 0.2}};

std::span<const Note> notes_of(Tone tone) {
  switch (tone) {
    case Tone::none:
      break;
    case Tone::low:
      return low_notes;
    case Tone::high:
      return high_notes;
    case Tone::double_low:
      return double_low_notes;
    case Tone::double_high:
      return double_high_notes;
    case Tone::rising:
      return rising_notes;
  }
  return {};
}

}  // namespace

Rgb rgb_of(Colour colour) {
  switch (colour) {
    case Colour::off:
      break;
    case Colour::white:
      return {255, 255, 255};
    case Colour::green:
      return {0, 255, 0};
    case Colour::blue:
      return {0, 0, 255};
    case Colour::yellow:
      return {255, 160, 0};
    case Colour::red:
      return {255, 0, 0};
  }
  return {};
}

Rgb dimmed(Rgb colour, double level) {
  const auto part = [&](std::uint8_t value) { return static_cast<std::uint8_t>(std::lround(value * level)); };
  return {part(colour.red), part(colour.green), part(colour.blue)};
}

double level_of(Pattern pattern, double time) {
  const auto phase = [&](double rate) { return time * rate - std::floor(time * rate); };
  switch (pattern) {
    case Pattern::steady:
      return 1.0;
    case Pattern::slow_blink:
      return phase(1.0) < 0.5 ? 1.0 : 0.0;
    case Pattern::fast_blink:
      return phase(4.0) < 0.5 ? 1.0 : 0.0;
    case Pattern::pulse:
      return 0.5 + 0.5 * std::cos(2.0 * M_PI * phase(0.5));
  }
  return 0.0;
}

double frequency_of(Tone tone, double time) {
  double end = 0.0;
  for (const Note& note : notes_of(tone)) {
    end += note.seconds;
    if (time < end) return note.frequency;
  }
  return 0.0;
}

}  // namespace gyre
