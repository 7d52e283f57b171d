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
  // Truncation and a correction: without SSE 4.1, floor is a library call and costs more than all the rest.
  const auto floor_of = [](float v) {
    const auto i = static_cast<std::int32_t>(v);
    return i - static_cast<std::int32_t>(static_cast<float>(i) > v);
  };
  const std::int32_t x = floor_of(p.x()), y = floor_of(p.y()), z = floor_of(p.z());
  const auto weight = [](float f) { return f * f * f * (f * (f * 6.0f - 15.0f) + 10.0f); };  // smooth second derivative
  const float wx = weight(p.x() - static_cast<float>(x));
  const float wy = weight(p.y() - static_cast<float>(y));
  const float wz = weight(p.z() - static_cast<float>(z));
  const std::uint32_t hx = static_cast<std::uint32_t>(x) * 0x8da6b343u ^ seed_,
                      hx1 = (static_cast<std::uint32_t>(x) + 1) * 0x8da6b343u ^ seed_;
  const std::uint32_t hy = static_cast<std::uint32_t>(y) * 0xd8163841u, hy1 = hy + 0xd8163841u;
  const std::uint32_t hz = static_cast<std::uint32_t>(z) * 0xcb1ab31fu, hz1 = hz + 0xcb1ab31fu;
  const auto corner = [](std::uint32_t h) {
    h = (h ^ (h >> 15)) * 0x2c1b3c6du;
    h = (h ^ (h >> 12)) * 0x297a2d39u;
    return static_cast<float>(static_cast<std::int32_t>(h)) * 0x1p-31f;
  };
  const auto row = [&](std::uint32_t yz) {
    const float a = corner(hx ^ yz);
    return a + wx * (corner(hx1 ^ yz) - a);
  };
  const float front_low = row(hy ^ hz), back_low = row(hy ^ hz1);
  const float front = front_low + wy * (row(hy1 ^ hz) - front_low);
  const float back = back_low + wy * (row(hy1 ^ hz1) - back_low);
  return front + wz * (back - front);
}

float Noise::fractal(const Eigen::Vector3f& p, float wavelength, int octaves, float persistence,
                     float footprint) const {
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
