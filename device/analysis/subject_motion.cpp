// SPDX-License-Identifier: Apache-2.0
#include "device/analysis/subject_motion.h"

#include "common/geometry/quantile.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

namespace gyre {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix26 = Eigen::Matrix<double, 2, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

// Of a still point's image by the camera's motion (turn, then shift).
Matrix26 by_motion(const Vector3d& x) {
  Eigen::Matrix<double, 2, 3> projection;
  projection << 1 / x.z(), 0, -x.x() / (x.z() * x.z()), 0, 1 / x.z(), -x.y() / (x.z() * x.z());
  Eigen::Matrix3d cross;
  cross << 0, -x.z(), x.y(), x.z(), 0, -x.x(), -x.y(), x.x(), 0;
  Matrix26 out;
  out << -projection * cross, projection;
  return out;
}

}  // namespace

SubjectShift subject_shift(std::span<const PointShift> points, double noise) {
  constexpr std::size_t least = 5;  // points of the subject
  constexpr int rounds = 4;
  constexpr double faint = 1.0 / (15 * 15);  // weight of the subject's points on the camera's motion
  Vector6 motion = Vector6::Zero();
  double scale = 2.0 * noise;
  for (int round = 0; round < rounds; ++round) {
    Eigen::Matrix<double, 6, 6> normal = 1e-12 * Eigen::Matrix<double, 6, 6>::Identity();
    Vector6 right = Vector6::Zero();
    std::vector<double> errors;
    for (const PointShift& point : points) {
      const Matrix26 by = by_motion(point.place);
      const double error = (point.shift - by * motion).norm();
      if (!point.is_subject) errors.push_back(error);
      const double weight = point.is_subject ? faint : 1.0 / (1.0 + error * error / (scale * scale));
      normal += weight * by.transpose() * by;
      right += weight * by.transpose() * point.shift;
    }
    motion = normal.ldlt().solve(right);
    if (!errors.empty()) scale = std::clamp(1.5 * median(std::move(errors)), 0.2 * noise, 2.0 * noise);
  }
  std::vector<double> shifts;
  for (const PointShift& point : points) {
    if (point.is_subject) shifts.push_back((point.shift - by_motion(point.place) * motion).norm());
  }
  if (shifts.size() < least) return {};
  return {median(shifts), quantile(shifts, 0.7)};
}

}  // namespace gyre
