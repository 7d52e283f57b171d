// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/turn_axis.h"

#include <Eigen/Eigenvalues>
#include <vector>

namespace gyre {

namespace {

constexpr int axis_rounds = 10;
constexpr double sound_tilt = 0.02;  // radians, and as a share of the distance: what a standing person sways
constexpr double min_spread = 0.01;  // 1 - (sin(a/2) / (a/2))^2 of a uniform turn by a, here some 20 degrees

// Sums over weighted poses with their means taken off.
struct Moments {
  Eigen::Matrix3d mean_rotation = Eigen::Matrix3d::Zero();
  Eigen::Vector3d mean_translation = Eigen::Vector3d::Zero();
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
};

Moments moments_of(std::span<const Pose> poses, const std::vector<double>& weights) {
  Moments m;
  double sum = 0.0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    m.mean_rotation += weights[i] * poses[i].rotation.toRotationMatrix();
    m.mean_translation += weights[i] * poses[i].translation;
    sum += weights[i];
  }
  m.mean_rotation /= sum;
  m.mean_translation /= sum;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Eigen::Matrix3d a = poses[i].rotation.toRotationMatrix() - m.mean_rotation;
    m.normal += weights[i] / sum * a.transpose() * a;
    m.right -= weights[i] / sum * a.transpose() * (poses[i].translation - m.mean_translation);
  }
  return m;
}

}  // namespace

std::optional<TurnAxis> turn_axis(std::span<const Pose> cam_from_subject) {
  if (cam_from_subject.size() < 3) return std::nullopt;
  std::vector<double> weights(cam_from_subject.size(), 1.0);
  TurnAxis axis;
  for (int round = 0; round < axis_rounds; ++round) {
    const Moments m = moments_of(cam_from_subject, weights);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(m.normal);
    if (eigen.eigenvalues()[1] < min_spread) return std::nullopt;
    axis.direction = eigen.eigenvectors().col(0);
    axis.point.setZero();
    for (int k = 1; k < 3; ++k) {
      const Eigen::Vector3d across = eigen.eigenvectors().col(k);
      axis.point += across * (across.dot(m.right) / eigen.eigenvalues()[k]);
    }
    const Eigen::Vector3d seen_direction = m.mean_rotation * axis.direction;
    const Eigen::Vector3d seen_point = m.mean_rotation * axis.point + m.mean_translation;
    if (seen_direction.y() > 0) axis.direction = -axis.direction;
    for (std::size_t i = 0; i < weights.size(); ++i) {
      const Pose& pose = cam_from_subject[i];
      const Eigen::Vector3d tilt = pose.rotation * axis.direction - seen_direction * (seen_direction.y() > 0 ? -1 : 1);
      const Eigen::Vector3d stray = pose * axis.point - seen_point;
      weights[i] = 1.0 / (tilt.norm() + stray.norm() / seen_point.norm() + sound_tilt);
    }
  }
  return axis;
}

}  // namespace gyre
