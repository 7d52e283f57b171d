// SPDX-License-Identifier: Apache-2.0
// A section through a surface as a curve, and where it stands out most.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

namespace gyre {

// A profile: distance out of the face over a coordinate, at equal steps; NaN where it is not known.
struct Curve {
  double low = 0, step = 0.001;
  std::vector<double> out;

  int index(double t) const { return static_cast<int>(std::lround((t - low) / step)); }
  double at(double t) const {
    const int i = index(t);
    return i < 0 || i >= static_cast<int>(out.size()) ? std::numeric_limits<double>::quiet_NaN() : out[i];
  }
};

// Local quadratic regression of the foremost points (Cleveland, "Robust locally weighted regression", JASA 1979, with
// one robust pass); `sample` holds (t, out).
Curve smooth_curve(const std::vector<Eigen::Vector2d>& sample, double low, double high, double width);

// Walking from `from` to `to`, the first place where the curve times `sign` is larger than everywhere within `window`
// on both sides, refined by a parabola over that window, or 6 mm if that is less. Nothing when there is none before an
// unknown stretch as long as the window.
std::optional<double> first_extremum(const Curve& curve, double sign, double from, double to, double window);

}  // namespace gyre
