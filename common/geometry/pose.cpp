// SPDX-License-Identifier: Apache-2.0
#include "common/geometry/pose.h"

#include <Eigen/SVD>
#include <cmath>

namespace gyre {

Eigen::Matrix4d Pose::matrix() const {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = rotation.toRotationMatrix();
  m.topRightCorner<3, 1>() = translation;
  return m;
}

Eigen::Matrix4d Similarity::matrix() const {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = scale * rotation.toRotationMatrix();
  m.topRightCorner<3, 1>() = translation;
  return m;
}

double angle_between(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  const Eigen::Quaterniond d = a * b.conjugate();
  return 2.0 * std::atan2(d.vec().norm(), std::abs(d.w()));
}

Eigen::Quaterniond rotation_about(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  const double s = angle > 1e-8 ? std::sin(0.5 * angle) / angle : 0.5;
  return {std::cos(0.5 * angle), s * w.x(), s * w.y(), s * w.z()};
}

Pose cam_from_moved_world(const Pose& cam_from_a, const Similarity& b_from_a) {
  // x_cam = R x_a + t and x_a = S^-1 x_b; multiplying x_cam by the scale keeps the image and gives a rigid pose.
  const Eigen::Quaterniond rotation = cam_from_a.rotation * b_from_a.rotation.conjugate();
  return {rotation, b_from_a.scale * cam_from_a.translation - rotation * b_from_a.translation};
}

Result<Similarity> align_points(std::span<const Eigen::Vector3d> a, std::span<const Eigen::Vector3d> b,
                                bool with_scale) {
  if (a.size() != b.size() || a.size() < 3) {
    return fail("cannot align points", std::to_string(a.size()) + " and " + std::to_string(b.size()) + " given",
                "at least three pairs are needed");
  }
  const double n = static_cast<double>(a.size());
  Eigen::Vector3d mean_a = Eigen::Vector3d::Zero();
  Eigen::Vector3d mean_b = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < a.size(); ++i) {
    mean_a += a[i] / n;
    mean_b += b[i] / n;
  }
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  double variance_b = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    covariance += (a[i] - mean_a) * (b[i] - mean_b).transpose() / n;
    variance_b += (b[i] - mean_b).squaredNorm() / n;
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d& d = svd.singularValues();
  if (d(1) <= 1e-12 * std::max(d(0), 1e-300)) {
    return fail("cannot align points", "all of them lie on a line", "use points that span a plane");
  }
  Eigen::Vector3d s = Eigen::Vector3d::Ones();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0.0) s(2) = -1.0;
  Similarity a_from_b;
  a_from_b.rotation = Eigen::Quaterniond(Eigen::Matrix3d(svd.matrixU() * s.asDiagonal() * svd.matrixV().transpose()));
  a_from_b.scale = with_scale ? d.dot(s) / variance_b : 1.0;
  a_from_b.translation = mean_a - a_from_b.scale * (a_from_b.rotation * mean_b);
  return a_from_b;
}

}  // namespace gyre
