// SPDX-License-Identifier: Apache-2.0
// How well a patch of one image matches what a plane puts it on in another.
#pragma once

#include "offload/cloud/stereo_view.h"

#include <array>

namespace gyre {

// Offsets of the patch's samples: every second pixel (dx + dy odd) of a disc of radius sqrt(17), so that a window nine
// pixels wide costs 32 samples, a whole number of vector lanes.
inline constexpr int patch_samples = 32;
struct PatchPattern {
  std::array<float, patch_samples> dx{};
  std::array<float, patch_samples> dy{};
};
constexpr PatchPattern make_patch_pattern() {
  PatchPattern pattern;
  int count = 0;
  for (int dy = -4; dy <= 4; ++dy) {
    for (int dx = -4; dx <= 4; ++dx) {
      if ((dx + dy) % 2 == 0 || dx * dx + dy * dy > 17) continue;
      pattern.dx[count] = static_cast<float>(dx);
      pattern.dy[count] = static_cast<float>(dy);
      ++count;
    }
  }
  return pattern;
}
inline constexpr PatchPattern patch_pattern = make_patch_pattern();

// The reference side of the comparison; made once a pixel and used for every hypothesis and view.
struct ReferencePatch {
  std::array<float, patch_samples> weight;    // bilateral, sum 1
  std::array<float, patch_samples> weighted;  // weight * (value - mean)
  float mean = 0;
  float variance = 0;
};

struct PatchOptions {
  float sigma_colour = 20.0F;  // levels of the channel that differs most
  float sigma_space = 5.0F;    // pixels
  float noise = 1.0F;          // grey levels; texture below it does not count as a match
};

// The two factors of the bilateral weight exp(-|dI| / sigma_colour - |d| / sigma_space) (Schönberger et al., ECCV 2016,
// section 4.2), tabulated.
class PatchWeights {
 public:
  explicit PatchWeights(const PatchOptions& options);

  // The patch about pixel (x, y); samples outside the image weigh nothing.
  ReferencePatch reference_patch(const ImageLevel& level, int x, int y) const;

 private:
  std::array<float, 256> colour_;
  std::array<float, patch_samples> space_;
};

// Where the patch lies in the source image under a homography: sample (dx, dy) maps to the homogeneous array index
// centre + dx * along_x + dy * along_y.
struct PatchMapping {
  std::array<float, 3> centre;
  std::array<float, 3> along_x;
  std::array<float, 3> along_y;
};

// Cost of a view that does not see the patch.
inline constexpr float worst_cost = 2.0F;

// 1 - bilaterally weighted normalised cross-correlation, in [0, 2]. The noise variance is added to both variances, so
// that flat patches score about 1, as unrelated ones do. worst_cost when the centre falls outside the source image or
// behind its camera; single samples outside are clamped to the border.
float matching_cost(const ReferencePatch& patch, const PatchMapping& mapping, const QuadImage& source, float noise);

}  // namespace gyre
