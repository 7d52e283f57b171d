// SPDX-License-Identifier: Apache-2.0
// Colours of the synthetic world: solid procedural textures, the same from every side and never repeating.
#pragma once

#include "common/mesh/mesh.h"
#include "tests/synthetic/noise.h"
#include "tests/synthetic/subject.h"
#include "tests/synthetic/trouble.h"

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace gyre::synthetic {

// Half extents of the room, metres; its floor is y = 0.
struct RoomSize {
  float half_width = 3.2f;  // x
  float half_depth = 3.4f;  // z
  float height = 2.9f;
};

// Linear RGB in [0, 1] to 8-bit sRGB (IEC 61966-2-1) and back.
Rgb encode_srgb(const Eigen::Vector3f& linear);
Eigen::Vector3f decode_srgb(int red, int green, int blue);

class Appearance {
 public:
  // `scale`: the subject's stature over the 1.70 m that faces and clothes are laid out for.
  explicit Appearance(std::uint64_t seed, double scale = 1.0, const RoomSize& room = {}, const Trouble& trouble = {});

  // Linear RGB reflectance at a point given in the axes the thing stands in (the subject's A-pose, the room's world).
  // `footprint`: what one pixel covers, metres; finer detail is left out.
  Eigen::Vector3f albedo(Material material, const Eigen::Vector3f& position, const Eigen::Vector3f& normal,
                         float footprint) const;

 private:
  // A rectangle on a wall with its own pattern.
  struct Poster {
    int wall;  // 0: -x, 1: +x, 2: -z, 3: +z
    Eigen::Vector2f low, high;
    Eigen::Vector3f paper, ink, accent;
    Eigen::Vector3f offset;
    float wavelength;
  };

  Eigen::Vector3f clothes(const Eigen::Vector3f& p, const Eigen::Vector3f& base, const Eigen::Vector3f& second,
                          float wavelength, float footprint) const;
  Eigen::Vector3f face(const Eigen::Vector3f& p, float footprint) const;
  Eigen::Vector3f skin(const Eigen::Vector3f& p, float footprint) const;
  Eigen::Vector3f floor(const Eigen::Vector3f& p, float footprint) const;
  Eigen::Vector3f wall(const Eigen::Vector3f& p, const Eigen::Vector3f& normal, float footprint) const;

  std::uint64_t seed_;
  Noise noise_;
  float scale_;
  Trouble trouble_;
  std::vector<Poster> posters_;
};

}  // namespace gyre::synthetic
