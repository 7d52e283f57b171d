// SPDX-License-Identifier: Apache-2.0
#include "tests/synthetic/noise.h"

#include <algorithm>
#include <cmath>

namespace gyre::synthetic {

std::uint64_t hash(std::uint64_t value) {
  value += 0x9e3779b97f4a7c15u;
  value = (value ^ (value >> 30)) * 0xbf58476d1ce4e5b9u;
  value = (value ^ (value >> 27)) * 0x94d049bb133111ebu;
  return value ^ (value >> 31);
}

float Noise::value(const Eigen::Vector3f& p) const {
  const Eigen::Vector3f cell = p.array().floor();
  const Eigen::Vector3f f = p - cell;
  // Quintic weights: continuous second derivatives, so that folds made of noise shade smoothly.
  const Eigen::Vector3f w = f.array().cube() * (f.array() * (f.array() * 6.0f - 15.0f) + 10.0f);
  const auto x = static_cast<std::uint32_t>(static_cast<std::int32_t>(cell.x()));
  const auto y = static_cast<std::uint32_t>(static_cast<std::int32_t>(cell.y()));
  const auto z = static_cast<std::uint32_t>(static_cast<std::int32_t>(cell.z()));
  float corner[8];
  for (std::uint32_t i = 0; i < 8; ++i) {
    std::uint32_t h = (x + (i & 1u)) * 0x8da6b343u ^ (y + (i >> 1 & 1u)) * 0xd8163841u ^ (z + (i >> 2)) * 0xcb1ab31fu ^ seed_;
    h = (h ^ (h >> 15)) * 0x2c1b3c6du;
    h = (h ^ (h >> 12)) * 0x297a2d39u;
    corner[i] = static_cast<float>((h ^ (h >> 15)) >> 8) * (2.0f / 16777216.0f) - 1.0f;
  }
  float row[4];
  for (int i = 0; i < 4; ++i) row[i] = corner[2 * i] + w.x() * (corner[2 * i + 1] - corner[2 * i]);
  const float front = row[0] + w.y() * (row[1] - row[0]);
  const float back = row[2] + w.y() * (row[3] - row[2]);
  return front + w.z() * (back - front);
}

float Noise::fractal(const Eigen::Vector3f& p, float wavelength, int octaves, float persistence, float footprint) const {
  float sum = 0.0f, amplitude = 1.0f, total = 0.0f;
  Eigen::Vector3f q = p / wavelength;
  for (int octave = 0; octave < octaves; ++octave) {
    total += amplitude;
    const float fade = std::clamp(wavelength / (2.0f * footprint) - 1.0f, 0.0f, 1.0f);
    if (fade > 0.0f) sum += fade * amplitude * value(q);
    wavelength *= 0.5f;
    amplitude *= persistence;
    q = 2.0f * q + Eigen::Vector3f(17.3f, 31.7f, 5.1f);  // the octaves' lattices must not share their planes
  }
  return 1.6f * sum / total;
}

}  // namespace gyre::synthetic
