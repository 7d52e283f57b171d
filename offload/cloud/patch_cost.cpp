// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/patch_cost.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdlib>

// The hot loop is compiled for wider vectors as well and chosen when the program starts. It holds no fused operations
// and adds in a fixed lane order, so every machine gets the same numbers. Sanitizers cannot run the chooser.
#if defined(__x86_64__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define GYRE_VECTOR_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define GYRE_VECTOR_CLONES
#endif

namespace gyre {
namespace {

constexpr int lanes = 8;

PatchPattern make_pattern() {
  constexpr int squared_radius = 17;
  PatchPattern pattern{};
  int count = 0;
  for (int dy = -4; dy <= 4; ++dy) {
    for (int dx = -4; dx <= 4; ++dx) {
      if ((dx + dy) % 2 == 0 || dx * dx + dy * dy > squared_radius) continue;
      pattern.dx[count] = static_cast<float>(dx);
      pattern.dy[count] = static_cast<float>(dy);
      ++count;
    }
  }
  assert(count == patch_samples);
  return pattern;
}

}  // namespace

const PatchPattern patch_pattern = make_pattern();

PatchWeights::PatchWeights(const PatchOptions& options) {
  for (int i = 0; i < 256; ++i)
    colour_[i] = static_cast<float>(std::exp(-i / static_cast<double>(options.sigma_colour)));
  for (int i = 0; i < patch_samples; ++i) {
    const double distance = std::sqrt(static_cast<double>(patch_pattern.dx[i]) * patch_pattern.dx[i] +
                                      static_cast<double>(patch_pattern.dy[i]) * patch_pattern.dy[i]);
    space_[i] = static_cast<float>(std::exp(-distance / static_cast<double>(options.sigma_space)));
  }
}

ReferencePatch PatchWeights::reference_patch(const ImageLevel& level, int x, int y) const {
  ReferencePatch patch;
  std::array<float, patch_samples> value;
  const QuadImage& image = level.image;
  const Rgb centre = level.colours[static_cast<std::size_t>(y) * image.width + x];
  float sum = 0;
  for (int i = 0; i < patch_samples; ++i) {
    const int u = x + static_cast<int>(patch_pattern.dx[i]);
    const int v = y + static_cast<int>(patch_pattern.dy[i]);
    value[i] = 0;
    patch.weight[i] = 0;
    if (u < 0 || v < 0 || u >= image.width || v >= image.height) continue;
    const Rgb& colour = level.colours[static_cast<std::size_t>(v) * image.width + u];
    const int difference =
        std::max({std::abs(colour[0] - centre[0]), std::abs(colour[1] - centre[1]), std::abs(colour[2] - centre[2])});
    value[i] = image.value(u, v);
    patch.weight[i] = colour_[difference] * space_[i];
    sum += patch.weight[i];
  }
  for (int i = 0; i < patch_samples; ++i) {
    patch.weight[i] /= sum;
    patch.mean += patch.weight[i] * value[i];
  }
  for (int i = 0; i < patch_samples; ++i) {
    const float off = value[i] - patch.mean;
    patch.weighted[i] = patch.weight[i] * off;
    patch.variance += patch.weighted[i] * off;
  }
  return patch;
}

GYRE_VECTOR_CLONES
float matching_cost(const ReferencePatch& patch, const PatchMapping& mapping, const QuadImage& source, float noise) {
  const float limit_x = static_cast<float>(source.width - 1);
  const float limit_y = static_cast<float>(source.height - 1);
  const auto [c0, c1, c2] = mapping.centre;
  if (!(c2 > 0.0F) || c0 < 0.0F || c1 < 0.0F || c0 > limit_x * c2 || c1 > limit_y * c2) return worst_cost;

  const std::uint32_t* texels = source.texels.data();
  const int stride = source.width;
  std::array<float, lanes> sum{};
  std::array<float, lanes> sum_squares{};
  std::array<float, lanes> product{};
  for (int first = 0; first < patch_samples; first += lanes) {
    for (int lane = 0; lane < lanes; ++lane) {
      const float dx = patch_pattern.dx[first + lane];
      const float dy = patch_pattern.dy[first + lane];
      const float inverse = 1.0F / (c2 + dx * mapping.along_x[2] + dy * mapping.along_y[2]);
      float u = (c0 + dx * mapping.along_x[0] + dy * mapping.along_y[0]) * inverse;
      float v = (c1 + dx * mapping.along_x[1] + dy * mapping.along_y[1]) * inverse;
      u = u > 0.0F ? u : 0.0F;
      v = v > 0.0F ? v : 0.0F;
      u = u < limit_x ? u : limit_x;
      v = v < limit_y ? v : limit_y;
      const int x = static_cast<int>(u);
      const int y = static_cast<int>(v);
      const float fx = u - static_cast<float>(x);
      const float fy = v - static_cast<float>(y);
      const std::uint32_t quad = texels[y * stride + x];
      const auto a = static_cast<float>(static_cast<int>(quad & 0xFFU));
      const auto b = static_cast<float>(static_cast<int>(quad >> 8U & 0xFFU));
      const auto c = static_cast<float>(static_cast<int>(quad >> 16U & 0xFFU));
      const auto d = static_cast<float>(static_cast<int>(quad >> 24U));
      const float top = a + fx * (b - a);
      const float bottom = c + fx * (d - c);
      // Relative to the reference's mean, so that the variance below loses no digits.
      const float value = top + fy * (bottom - top) - patch.mean;
      const float weighted = patch.weight[first + lane] * value;
      sum[lane] += weighted;
      sum_squares[lane] += weighted * value;
      product[lane] += patch.weighted[first + lane] * value;
    }
  }
  float s = 0;
  float ss = 0;
  float p = 0;
  for (int lane = 0; lane < lanes; ++lane) {
    s += sum[lane];
    ss += sum_squares[lane];
    p += product[lane];
  }
  const float noise_variance = noise * noise;
  const float variance = std::max(ss - s * s, 0.0F);
  return 1.0F - p / std::sqrt((patch.variance + noise_variance) * (variance + noise_variance));
}

}  // namespace gyre
