// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/colour.h"

#include <algorithm>
#include <cmath>

namespace gyre {

namespace {

// The sRGB curve without the upper clamp.
double encode(double linear) {
  return 255.0 * (linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055);
}

}  // namespace

float linear_from_encoded(float encoded) {
  const double v = std::clamp(encoded / 255.0F, 0.0F, 1.0F);
  return static_cast<float>(v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
}

float encoded_from_linear(float linear) {
  return static_cast<float>(encode(std::clamp(linear, 0.0F, 1.0F)));
}

Eigen::Vector3f lab_from_bgr(const Eigen::Vector3f& bgr) {
  const Eigen::Vector3d rgb(linear_from_encoded(bgr[2]), linear_from_encoded(bgr[1]), linear_from_encoded(bgr[0]));
  Eigen::Matrix3d xyz_from_rgb;
  xyz_from_rgb << 0.4124564, 0.3575761, 0.1804375, 0.2126729, 0.7151522, 0.0721750, 0.0193339, 0.1191920, 0.9503041;
  const Eigen::Vector3d white(0.95047, 1.0, 1.08883);
  const Eigen::Vector3d ratio = (xyz_from_rgb * rgb).cwiseQuotient(white);
  const Eigen::Vector3d f = ratio.unaryExpr(
      [](double t) { return t > 216.0 / 24389.0 ? std::cbrt(t) : (24389.0 / 27.0 * t + 16.0) / 116.0; });
  return Eigen::Vector3d(116 * f.y() - 16, 500 * (f.x() - f.y()), 200 * (f.y() - f.z())).cast<float>();
}

Eigen::Vector3f bgr_from_lab(const Eigen::Vector3f& lab) {
  Eigen::Matrix3d rgb_from_xyz;
  rgb_from_xyz << 3.2404542, -1.5371385, -0.4985314, -0.9692660, 1.8760108, 0.0415560, 0.0556434, -0.2040259, 1.0572252;
  const double fy = (double{lab[0]} + 16.0) / 116.0;
  const Eigen::Vector3d f(fy + double{lab[1]} / 500.0, fy, fy - double{lab[2]} / 200.0);
  const Eigen::Vector3d ratio =
      f.unaryExpr([](double v) { return v > 6.0 / 29.0 ? v * v * v : (116.0 * v - 16.0) * 27.0 / 24389.0; });
  const Eigen::Vector3d rgb = rgb_from_xyz * ratio.cwiseProduct(Eigen::Vector3d(0.95047, 1.0, 1.08883));
  return {encoded_from_linear(static_cast<float>(rgb[2])), encoded_from_linear(static_cast<float>(rgb[1])),
          encoded_from_linear(static_cast<float>(rgb[0]))};
}

ToneCurve::ToneCurve(const Eigen::Vector3d& gain_bgr) : gain_(gain_bgr) {
  for (int c = 0; c < 3; ++c) {
    for (int v = 0; v < 256; ++v) {
      table_[c][v] = static_cast<float>(encode(linear_from_encoded(static_cast<float>(v)) * gain_[c]));
    }
    table_[c][256] = table_[c][255];
  }
}

Eigen::Vector3f ToneCurve::apply(const Eigen::Vector3f& bgr) const {
  Eigen::Vector3f out;
  for (int c = 0; c < 3; ++c) {
    const float v = std::clamp(bgr[c], 0.0F, 255.0F);
    const int i = static_cast<int>(v);
    out[c] = table_[c][i] + (v - static_cast<float>(i)) * (table_[c][i + 1] - table_[c][i]);
  }
  return out;
}

}  // namespace gyre
