// SPDX-License-Identifier: Apache-2.0
#include "tests/synthetic/appearance.h"

#include <algorithm>
#include <cmath>

namespace gyre::synthetic {

namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

// 0 below -width, 1 above width: an edge no sharper than a pixel.
float step_edge(float signed_distance, float width) {
  return std::clamp(0.5f + 0.5f * signed_distance / width, 0.0f, 1.0f);
}

Vector3f mix(const Vector3f& a, const Vector3f& b, float t) {
  return a + t * (b - a);
}

// Two colours in islands, as on printed cloth or paint that peels.
float islands(float noise, float level, float softness) {
  return std::clamp(0.5f + (noise - level) / softness, 0.0f, 1.0f);
}

// How far outside an ellipse, in units of its radii; negative inside.
float ellipse(float x, float y, float cx, float cy, float rx, float ry) {
  return std::hypot((x - cx) / rx, (y - cy) / ry) - 1.0f;
}

}  // namespace

Rgb encode_srgb(const Vector3f& linear) {
  Rgb out;
  for (int k = 0; k < 3; ++k) {
    const float v = std::clamp(linear[k], 0.0f, 1.0f);
    const float e = v <= 0.0031308f ? 12.92f * v : 1.055f * std::pow(v, 1.0f / 2.4f) - 0.055f;
    out[k] = static_cast<std::uint8_t>(std::lround(255.0f * e));
  }
  return out;
}

Vector3f decode_srgb(int red, int green, int blue) {
  const auto decode = [](int value) {
    const float e = static_cast<float>(value) / 255.0f;
    return e <= 0.04045f ? e / 12.92f : std::pow((e + 0.055f) / 1.055f, 2.4f);
  };
  return {decode(red), decode(green), decode(blue)};
}

Appearance::Appearance(std::uint64_t seed, double scale, const RoomSize& room, const Trouble& trouble)
    : seed_(hash(seed, 23)), noise_(seed_), scale_(static_cast<float>(scale)), trouble_(trouble) {
  for (int wall = 0; wall < 4; ++wall) {
    const float half = wall < 2 ? room.half_depth : room.half_width;
    for (int i = 0; i < 9; ++i) {
      std::uint64_t bits = hash(seed_, static_cast<std::uint64_t>(100 * wall + i));
      const auto next = [&](float low, float high) {
        bits = hash(bits);
        return low + static_cast<float>(uniform(bits)) * (high - low);
      };
      Poster poster;
      poster.wall = wall;
      const Vector2f size(next(0.35f, 0.9f), next(0.3f, 0.8f));
      const float low_x = -half + 0.1f, high_x = half - 0.1f - size.x();
      poster.low = {next(low_x, high_x), next(0.3f, room.height - 0.2f - size.y())};
      poster.high = poster.low + size;
      const auto colour = [&](float dark, float light) {
        return Vector3f(next(dark, light), next(dark, light), next(dark, light));
      };
      poster.paper = colour(0.35f, 0.9f);
      poster.ink = colour(0.02f, 0.3f);
      poster.accent = colour(0.05f, 0.8f);
      poster.offset = Vector3f(next(0, 50), next(0, 50), next(0, 50));
      poster.wavelength = next(0.10f, 0.25f);
      posters_.push_back(poster);
    }
  }
}

Vector3f Appearance::albedo(Material material, const Vector3f& position, const Vector3f& normal,
                            float footprint) const {
  const Vector3f p = position / scale_;
  if (trouble_.white_half && position.x() < 0 && (material == Material::wall || material == Material::ceiling))
    return decode_srgb(236, 234, 228);
  if (trouble_.dark_clothes && (material == Material::sweater || material == Material::trousers))
    return decode_srgb(14, 14, 16) * (1.0f + 0.2f * noise_.fractal(p, 0.045f, 5, 0.8f, footprint));
  switch (material) {
    case Material::skin:
      return skin(p, footprint);
    case Material::face:
      return face(p, footprint);
    case Material::hair: {
      const float strands = noise_.fractal(p.cwiseProduct(Vector3f(1, 0.3f, 1)), 0.03f, 4, 0.85f, footprint);
      return decode_srgb(96, 66, 46) * std::max(0.15f, 1.0f + 1.3f * strands);
    }
    case Material::sweater:
      return clothes(p, decode_srgb(172, 62, 54), decode_srgb(226, 196, 150), 0.09f, footprint);
    case Material::trousers:
      return clothes(p + Vector3f(3, 0, 0), decode_srgb(58, 82, 128), decode_srgb(120, 146, 178), 0.07f, footprint);
    case Material::shoe: {
      if (p.y() < 0.016f)
        return decode_srgb(214, 208, 196) * (1.0f + 0.2f * noise_.fractal(p, 0.03f, 3, 0.6f, footprint));
      const float lace = step_edge(0.004f - std::abs(std::fmod(p.z() + 1.0f, 0.024f) - 0.012f), footprint);
      const Vector3f leather = decode_srgb(92, 60, 40) * (1.0f + 0.5f * noise_.fractal(p, 0.05f, 4, 0.7f, footprint));
      return mix(leather, decode_srgb(232, 226, 210), p.z() > 0.01f && p.z() < 0.09f && p.y() > 0.045f ? lace : 0.0f);
    }
    case Material::floor:
      return floor(position, footprint);
    case Material::ceiling:
      return mix(decode_srgb(226, 222, 212), decode_srgb(186, 190, 192),
                 islands(noise_.fractal(position, 0.5f, 5, 0.65f, footprint), 0.1f, 0.1f)) *
             (1.0f + 0.3f * noise_.fractal(position, 0.15f, 5, 0.8f, footprint));
    case Material::wall:
      return wall(position, normal, footprint);
    case Material::mirror:
      return Vector3f::Constant(0.9f);
    case Material::box: {
      const auto which =
          static_cast<std::uint64_t>(std::lround(2.0f * (position.x() + 2.0f * position.z()) + 100.0f)) / 3;
      const std::uint64_t bits = hash(seed_, which);
      const Vector3f tint(0.25f + 0.5f * static_cast<float>(uniform(bits)),
                          0.25f + 0.5f * static_cast<float>(uniform(hash(bits))),
                          0.25f + 0.5f * static_cast<float>(uniform(hash(bits, 1))));
      const float print = islands(noise_.fractal(position, 0.15f, 4, 0.6f, footprint), 0.12f, 0.1f);
      return mix(tint, Vector3f(0.06f, 0.07f, 0.10f), print) *
             (1.0f + 0.4f * noise_.fractal(position, 0.06f, 4, 0.7f, footprint));
    }
  }
  return Vector3f::Constant(0.5f);
}

Vector3f Appearance::clothes(const Vector3f& p, const Vector3f& base, const Vector3f& second, float wavelength,
                             float footprint) const {
  const float print = islands(noise_.fractal(p + Vector3f(7, 1, 4), wavelength, 3, 0.5f, footprint), 0.22f, 0.12f);
  const float fabric = noise_.fractal(p + Vector3f(1, 9, 2), 0.045f, 5, 0.8f, footprint);
  const float worn = noise_.fractal(p, 0.5f, 2, 0.5f, footprint);
  return mix(base, second, print) * std::max(0.2f, 1.0f + 0.8f * fabric + 0.25f * worn);
}

Vector3f Appearance::skin(const Vector3f& p, float footprint) const {
  const float pores = noise_.fractal(p, 0.02f, 4, 0.8f, footprint);
  const float blush = noise_.fractal(p + Vector3f(2, 2, 2), 0.12f, 3, 0.6f, footprint);
  const float freckles = islands(noise_.fractal(p + Vector3f(5, 5, 5), 0.009f, 2, 0.5f, footprint), 0.55f, 0.15f);
  const Vector3f tone =
      mix(decode_srgb(222, 176, 150), decode_srgb(212, 154, 130), std::clamp(0.5f + blush, 0.0f, 1.0f));
  return mix(tone, decode_srgb(150, 98, 76), 0.55f * freckles) * (1.0f + 0.25f * pores);
}

Vector3f Appearance::face(const Vector3f& p, float footprint) const {
  Vector3f colour = skin(p, footprint);
  if (p.z() < 0.04f) return colour;
  const float x = std::abs(p.x()), y = p.y();
  const auto paint = [&](float outside, float radius, const Vector3f& with) {
    colour = mix(colour, with, step_edge(-outside * radius, 0.5f * footprint + 0.0005f));
  };
  paint(ellipse(x, y, 0.032f, 1.632f, 0.020f, 0.0045f), 0.0045f, decode_srgb(66, 44, 32));   // brow
  paint(ellipse(x, y, 0.032f, 1.608f, 0.0165f, 0.0085f), 0.0085f, decode_srgb(70, 46, 40));  // lashes
  paint(ellipse(x, y, 0.032f, 1.608f, 0.0150f, 0.0068f), 0.0068f, decode_srgb(236, 232, 226));
  paint(ellipse(x, y, 0.032f, 1.608f, 0.0066f, 0.0066f), 0.0066f, decode_srgb(72, 104, 112));
  paint(ellipse(x, y, 0.032f, 1.608f, 0.0030f, 0.0030f), 0.0030f, decode_srgb(12, 12, 14));
  paint(ellipse(x, y, 0.008f, 1.562f, 0.0040f, 0.0022f), 0.0022f, decode_srgb(110, 62, 52));  // nostrils
  paint(ellipse(x, y, 0.0f, 1.533f, 0.026f, 0.0085f), 0.0085f, decode_srgb(178, 84, 82));
  paint(ellipse(x, y, 0.0f, 1.534f, 0.024f, 0.0012f), 0.0012f, decode_srgb(92, 40, 42));
  return colour;
}

Vector3f Appearance::floor(const Vector3f& p, float footprint) const {
  const float radius = std::hypot(p.x(), p.z());
  Vector3f colour;
  if (radius < 1.15f) {  // a rug
    const float print = islands(noise_.fractal(p + Vector3f(0, 4, 0), 0.25f, 4, 0.55f, footprint), 0.05f, 0.1f);
    const Vector3f ground = mix(decode_srgb(46, 66, 74), decode_srgb(206, 176, 120), print);
    colour = ground * (1.0f + 0.45f * noise_.fractal(p, 0.05f, 4, 0.75f, footprint));
    if (radius > 1.08f)
      colour = decode_srgb(220, 208, 184) * (1.0f + 0.4f * noise_.fractal(p, 0.03f, 3, 0.7f, footprint));
  } else {  // planks of uneven length along x
    const float row = std::floor(p.z() / 0.14f);
    const auto row_bits = hash(seed_, static_cast<std::uint64_t>(static_cast<std::int64_t>(row) + 1000));
    const float along = p.x() + 1.3f * static_cast<float>(uniform(row_bits));
    const float plank = std::floor(along / 1.3f);
    const auto bits = hash(row_bits, static_cast<std::uint64_t>(static_cast<std::int64_t>(plank) + 1000));
    const float grain =
        noise_.fractal(p.cwiseProduct(Vector3f(0.12f, 1, 1)) + Vector3f(0, static_cast<float>(uniform(bits)) * 9, 0),
                       0.04f, 4, 0.7f, footprint);
    const float knots = islands(noise_.fractal(p + Vector3f(0, 7, 0), 0.09f, 3, 0.6f, footprint), 0.5f, 0.2f);
    colour = mix(decode_srgb(176, 128, 84), decode_srgb(92, 62, 40), knots) *
             (0.75f + 0.5f * static_cast<float>(uniform(hash(bits))) + 0.35f * grain);
    const float to_seam =
        std::min({p.z() - row * 0.14f, (row + 1) * 0.14f - p.z(), along - plank * 1.3f, (plank + 1) * 1.3f - along});
    colour = mix(colour, decode_srgb(40, 28, 20), step_edge(0.003f - to_seam, footprint));
  }
  // The contact shadow of someone who stands there.
  return colour * (1.0f - 0.45f * std::exp(-radius * radius / 0.09f));
}

Vector3f Appearance::wall(const Vector3f& p, const Vector3f& normal, float footprint) const {
  const bool along_z = std::abs(normal.x()) > 0.5f;
  const int which = along_z ? (p.x() < 0 ? 0 : 1) : (p.z() < 0 ? 2 : 3);
  const Vector2f at(along_z ? p.z() : p.x(), p.y());
  const Vector3f tints[4] = {decode_srgb(196, 188, 170), decode_srgb(160, 182, 188), decode_srgb(206, 190, 180),
                             decode_srgb(176, 190, 164)};
  const float stains = islands(noise_.fractal(p + Vector3f(1, 3, 8), 0.45f, 5, 0.6f, footprint), 0.18f, 0.15f);
  Vector3f colour = mix(tints[which], 0.55f * tints[(which + 1) % 4], stains) *
                    (1.0f + 0.4f * noise_.fractal(p, 0.12f, 5, 0.8f, footprint));
  for (const Poster& poster : posters_) {
    if (poster.wall != which || at.x() < poster.low.x() || at.x() > poster.high.x() || at.y() < poster.low.y() ||
        at.y() > poster.high.y())
      continue;
    const Vector3f q = p + poster.offset;
    const float ink = islands(noise_.fractal(q, poster.wavelength, 4, 0.6f, footprint), 0.1f, 0.08f);
    const float accent =
        islands(noise_.fractal(q + Vector3f(3, 3, 3), 0.6f * poster.wavelength, 3, 0.6f, footprint), 0.35f, 0.08f);
    colour = mix(mix(poster.paper, poster.ink, ink), poster.accent, accent) *
             (1.0f + 0.25f * noise_.fractal(q, 0.03f, 3, 0.7f, footprint));
    const float to_frame = std::min((at - poster.low).minCoeff(), (poster.high - at).minCoeff());
    colour = mix(colour, Vector3f::Constant(0.05f), step_edge(0.02f - to_frame, footprint));
  }
  return colour;
}

}  // namespace gyre::synthetic
