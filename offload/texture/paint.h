// SPDX-License-Identifier: Apache-2.0
// Painting the photographs' colours into the texels.
#pragma once

#include "offload/texture/atlas.h"
#include "offload/texture/labelling.h"
#include "offload/texture/observations.h"

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

namespace gyre {

// How a texel got its colour. Written to files: new ones at the end.
enum class TexelOrigin : std::uint8_t { none, loose, strict, filled, generated, mirrored };
constexpr std::size_t texel_origins = 6;

// A texture in the making; all arrays row major, one entry a texel.
struct Canvas {
  std::vector<Eigen::Vector3f> colour;  // encoded BGR
  std::vector<TexelOrigin> origin;
  std::vector<std::int16_t> photo;       // -1: none
  std::vector<std::uint8_t> confidence;  // 255: looked at head-on by the sharpest photographs
};

struct PaintJob {
  const PhotographedSurface& surface;
  const Atlas& atlas;
  std::span<const int> label;                             // photograph of each triangle, -1: none
  const std::vector<std::vector<Candidate>>& candidates;  // of each triangle
  std::span<const double> sharpness;                      // of each photograph, (0, 1]
};

// Every texel of a labelled triangle takes the colour of the triangle's photograph; where that does not pass the loose
// limits at the texel itself, of the triangle's cheapest candidate that does.
Canvas paint(const PaintJob& job, int threads);

}  // namespace gyre
