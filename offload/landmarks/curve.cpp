// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/curve.h"

#include <Eigen/Cholesky>
#include <algorithm>

namespace gyre {

Curve smooth_curve(const std::vector<Eigen::Vector2d>& sample, double low, double high, double width) {
  Curve curve;
  curve.low = low;
  for (double t = low; t <= high; t += curve.step) {
    double foremost = -std::numeric_limits<double>::infinity();
    for (const Eigen::Vector2d& s : sample)
      if (std::abs(s.x() - t) < width) foremost = std::max(foremost, s.y());
    std::optional<Eigen::Vector3d> fit;
    for (int pass = 0; pass < 2; ++pass) {
      Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
      Eigen::Vector3d b = Eigen::Vector3d::Zero();
      double total = 0, before = 0, after = 0;
      for (const Eigen::Vector2d& s : sample) {
        const double d = (s.x() - t) / width;
        if (std::abs(d) >= 1 || s.y() < foremost - 0.02) continue;
        const Eigen::Vector3d row(1, d, d * d);
        double weight = std::pow(1 - std::abs(d * d * d), 3);
        if (fit) weight /= 1 + std::pow((s.y() - row.dot(*fit)) / 0.0015, 2);
        a += weight * row * row.transpose();
        b += weight * s.y() * row;
        total += weight;
        (d < 0 ? before : after) += weight;
      }
      if (total < 4 || std::min(before, after) < 0.15 * total) {
        fit.reset();
        break;
      }
      a.diagonal() += Eigen::Vector3d(0, 1e-3, 1e-2) * total;
      fit = a.ldlt().solve(b);
    }
    curve.out.push_back(fit ? (*fit)[0] : std::numeric_limits<double>::quiet_NaN());
  }
  return curve;
}

std::optional<double> first_extremum(const Curve& curve, double sign, double from, double to, double window) {
  const int count = static_cast<int>(curve.out.size()), reach = static_cast<int>(std::lround(window / curve.step));
  const int first = curve.index(from), last = curve.index(to), way = first < last ? 1 : -1;
  int unknown = 0;
  for (int i = first; i != last + way; i += way) {
    if (i < 1 || i + 1 >= count || std::isnan(curve.out[i])) {
      if (++unknown > reach) return std::nullopt;
      continue;
    }
    unknown = 0;
    bool largest = true;
    int before = 0, after = 0;  // lower neighbours on either side
    for (int k = -reach; k <= reach; ++k) {
      if (k == 0 || i + k < 0 || i + k >= count || std::isnan(curve.out[i + k])) continue;
      largest = largest && sign * curve.out[i + k] <= sign * curve.out[i];
      (k < 0 ? before : after) += sign * curve.out[i + k] < sign * curve.out[i] ? 1 : 0;
    }
    if (!largest || before < reach / 2 || after < reach / 2) continue;
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    const int near = std::min(reach, static_cast<int>(std::lround(0.006 / curve.step)));
    for (int k = std::max(-near, -i); k <= std::min(near, count - 1 - i); ++k) {
      if (std::isnan(curve.out[i + k])) continue;
      const double d = k * curve.step / window;
      const Eigen::Vector3d row(1, d, d * d);
      a += row * row.transpose();
      b += sign * curve.out[i + k] * row;
    }
    const double t = curve.low + i * curve.step;
    const Eigen::Vector3d fit = a.ldlt().solve(b);
    if (fit[2] >= -1e-9) return t;
    return t + window * std::clamp(-0.5 * fit[1] / fit[2], -0.5, 0.5);
  }
  return std::nullopt;
}

}  // namespace gyre
