// SPDX-License-Identifier: Apache-2.0
// Seeded noise in space: what cloth, skin, walls and folds of the synthetic captures are made of.
#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace gyre::synthetic {

// Counter-based random bits (the finaliser of SplitMix64): equal input, equal output, on every machine.
std::uint64_t hash(std::uint64_t value);
inline std::uint64_t hash(std::uint64_t a, std::uint64_t b) {
  return hash(hash(a) ^ b);
}

// Uniform in [0, 1).
inline double uniform(std::uint64_t bits) {
  return static_cast<double>(bits >> 11) * 0x1.0p-53;
}

// Value noise on an endless lattice.
class Noise {
 public:
  explicit Noise(std::uint64_t seed) : seed_(static_cast<std::uint32_t>(hash(seed))) {}

  // Smooth, in [-1, 1], with features one unit apart.
  float value(const Eigen::Vector3f& p) const;

  // Octaves of halved wavelength (metres) and falling amplitude, about in [-1, 1]. Octaves finer than twice `footprint`
  // (what one pixel covers, metres) fade out, so that pictures do not alias (Norton, Rockwood and Skolmoski,
  // "Clamping: a method of antialiasing textured surfaces by bandwidth limiting in object space", SIGGRAPH 1982).
  float fractal(const Eigen::Vector3f& p, float wavelength, int octaves, float persistence, float footprint) const;

 private:
  std::uint32_t seed_;
};

}  // namespace gyre::synthetic
