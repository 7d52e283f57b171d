// SPDX-License-Identifier: Apache-2.0
// Conversions between encoded sRGB, linear light and CIELAB.
#pragma once

#include <Eigen/Core>
#include <array>

namespace gyre {

// sRGB transfer function (IEC 61966-2-1): encoded value in [0, 255] to linear light in [0, 1] and back. Values outside
// are clamped.
float linear_from_encoded(float encoded);
float encoded_from_linear(float linear);

// CIELAB under D65 of an encoded BGR colour in [0, 255].
Eigen::Vector3f lab_from_bgr(const Eigen::Vector3f& bgr);

// And back; what sRGB does not hold is clamped.
Eigen::Vector3f bgr_from_lab(const Eigen::Vector3f& lab);

// Multiplies a photograph's colours by one gain a channel in linear light, on encoded values.
class ToneCurve {
 public:
  explicit ToneCurve(const Eigen::Vector3d& gain_bgr = Eigen::Vector3d::Ones());

  const Eigen::Vector3d& gain() const { return gain_; }
  // Encoded BGR in, encoded BGR out; bright results may exceed 255, which keeps blends of over-exposed views right.
  Eigen::Vector3f apply(const Eigen::Vector3f& bgr) const;

 private:
  Eigen::Vector3d gain_;
  std::array<std::array<float, 257>, 3> table_{};
};

}  // namespace gyre
