// SPDX-License-Identifier: Apache-2.0
// Painting the photographs' colours into the texels.
#pragma once

#include "offload/texture/atlas.h"
#include "offload/texture/labelling.h"
#include "offload/texture/levelling.h"
#include "offload/texture/observations.h"

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

namespace gyre {

// How a texel got its colour.
enum class TexelOrigin : std::uint8_t { none, loose, strict, filled, generated };

// A texture in the making; all arrays row major, one entry a texel.
struct Canvas {
  std::vector<Eigen::Vector3f> colour;  // encoded BGR
  std::vector<TexelOrigin> origin;
  std::vector<std::int16_t> photo;  // the one with the largest weight, -1: none
};

struct PaintJob {
  const PhotographedSurface& surface;
  const Atlas& atlas;
  std::span<const int> label;                             // photograph of each triangle, -1: none
  const std::vector<std::vector<Candidate>>& candidates;  // of each triangle
  const VertexPatches& patches;
};

// Every texel of a labelled triangle takes the photographs of its corners, weighted by the third power of their
// interpolated shares, so that neighbouring patches cross-fade within one ring of triangles, on both sides of a texture
// seam alike. A photograph that does not pass the loose limits at the texel itself is left out; when none is left, the
// triangle's cheapest candidate that does is taken.
Canvas paint(const PaintJob& job, int threads);

}  // namespace gyre
