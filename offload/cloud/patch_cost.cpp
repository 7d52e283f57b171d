// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/patch_cost.h"

#include <algorithm>
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

constexpr int offset_x(int i) {
  return static_cast<int>(patch_pattern.dx[i]);
}
constexpr int offset_y(int i) {
  return static_cast<int>(patch_pattern.dy[i]);
}

float total(const std::array<float, lanes>& values) {
  float sum = 0;
  for (const float value : values) sum += value;
  return sum;
}

}  // namespace

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
  const std::size_t here = static_cast<std::size_t>(y) * image.width + x;
  const int red = level.colours[here][0];
  const int green = level.colours[here][1];
  const int blue = level.colours[here][2];
  const auto add = [&](int i, std::size_t there) {
    const Rgb& colour = level.colours[there];
    const int difference =
        std::max(std::max(std::abs(colour[0] - red), std::abs(colour[1] - green)), std::abs(colour[2] - blue));
    value[i] = static_cast<float>(image.texels[there] & 0xFFU);
    patch.weight[i] = colour_[difference] * space_[i];
  };
  constexpr int reach = 4;
  if (x >= reach && y >= reach && x + reach < image.width && y + reach < image.height) {
    for (int i = 0; i < patch_samples; ++i)
      add(i, here + static_cast<std::size_t>(offset_x(i) + offset_y(i) * image.width));
  } else {
    value.fill(0);
    patch.weight.fill(0);
    for (int i = 0; i < patch_samples; ++i) {
      const int u = x + offset_x(i);
      const int v = y + offset_y(i);
      if (u >= 0 && v >= 0 && u < image.width && v < image.height)
        add(i, static_cast<std::size_t>(v) * image.width + u);
    }
  }
  // Sums by lanes, which every machine adds in the same order.
  std::array<float, lanes> sum{};
  std::array<float, lanes> product{};
  for (int first = 0; first < patch_samples; first += lanes) {
    for (int lane = 0; lane < lanes; ++lane) {
      sum[lane] += patch.weight[first + lane];
      product[lane] += patch.weight[first + lane] * value[first + lane];
    }
  }
  const float inverse = 1.0F / total(sum);
  patch.mean = total(product) * inverse;
  std::array<float, lanes> square{};
  for (int first = 0; first < patch_samples; first += lanes) {
    for (int lane = 0; lane < lanes; ++lane) {
      const float off = value[first + lane] - patch.mean;
      patch.weight[first + lane] *= inverse;
      patch.weighted[first + lane] = patch.weight[first + lane] * off;
      square[lane] += patch.weighted[first + lane] * off;
    }
  }
  patch.variance = total(square);
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
      const std::uint32_t quad = texels[static_cast<std::uint32_t>(y * stride + x)];
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
  const float s = total(sum);
  const float ss = total(sum_squares);
  const float p = total(product);
  const float noise_variance = noise * noise;
  const float variance = std::max(ss - s * s, 0.0F);
  return 1.0F - p / std::sqrt((patch.variance + noise_variance) * (variance + noise_variance));
}

}  // namespace gyre
