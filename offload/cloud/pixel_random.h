// SPDX-License-Identifier: Apache-2.0
// Random numbers that depend on the pixel and the step alone, whoever computes it.
#pragma once

#include <cstddef>
#include <cstdint>

namespace gyre {

// SplitMix64 (Steele et al., OOPSLA 2014): a stream of numbers for each pixel and step.
class PixelRandom {
 public:
  PixelRandom(std::uint64_t seed, int step, std::size_t pixel)
      : state_(seed * 0x9E3779B97F4A7C15U + static_cast<std::uint64_t>(step) * 0xD1B54A32D192ED03U +
               static_cast<std::uint64_t>(pixel) * 0x8CB92BA72F3D8DD7U) {}

  // Uniform in [0, 1).
  float uniform() {
    state_ += 0x9E3779B97F4A7C15U;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9U;
    z = (z ^ (z >> 27U)) * 0x94D049BB133111EBU;
    return static_cast<float>((z ^ (z >> 31U)) >> 40U) * 0x1p-24F;
  }
  // Uniform in [-1, 1).
  float symmetric() { return 2.0F * uniform() - 1.0F; }

 private:
  std::uint64_t state_;
};

}  // namespace gyre
