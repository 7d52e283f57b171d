// SPDX-License-Identifier: Apache-2.0
#include "device/analysis/relative_pose.h"

#include "common/geometry/quantile.h"

#include <Eigen/Cholesky>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

namespace gyre {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

using Rays = std::vector<Vector3d>;  // z = 1

Rays rays_of(std::span<const Vector2d> pixels, const Camera& camera) {
  Rays rays;
  rays.reserve(pixels.size());
  for (const Vector2d& pixel : pixels) rays.push_back(camera.normalised_from_pixel(pixel).homogeneous());
  return rays;
}

// Signed, in pixels of focal length `focal`.
double sampson(const Matrix3d& essential, const Vector3d& a, const Vector3d& b, double focal) {
  const Vector3d line_b = essential * a;
  const Vector3d line_a = essential.transpose() * b;
  const double slope = line_b.head<2>().squaredNorm() + line_a.head<2>().squaredNorm();
  return focal * b.dot(line_b) / std::sqrt(std::max(slope, 1e-18));
}

Matrix3d essential_of(const Pose& b_from_a) {
  const Vector3d& t = b_from_a.translation;
  Matrix3d cross;
  cross << 0, -t.z(), t.y(), t.z(), 0, -t.x(), -t.y(), t.x(), 0;
  return cross * b_from_a.rotation.toRotationMatrix();
}

std::vector<double> epipolar_errors(const Pose& b_from_a, const Rays& a, const Rays& b, double focal) {
  const Matrix3d essential = essential_of(b_from_a);
  std::vector<double> errors;
  errors.reserve(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) errors.push_back(sampson(essential, a[i], b[i], focal));
  return errors;
}

double cauchy_cost(const std::vector<double>& errors, double scale) {
  double cost = 0.0;
  for (const double e : errors) cost += std::log1p(e * e / (scale * scale));
  return cost;
}

// The pose moved by a turn and by a turn of its unit translation in the plane across it.
Pose moved(const Pose& pose, const Eigen::Matrix<double, 5, 1>& step) {
  const Vector3d t = pose.translation;
  const Vector3d across = t.unitOrthogonal();
  const Vector3d turned = t + step[3] * across + step[4] * t.cross(across);
  return {(rotation_about(step.head<3>()) * pose.rotation).normalized(), turned.normalized()};
}

// Levenberg-Marquardt on the Sampson distances with Cauchy weights.
Pose refined(Pose pose, const Rays& a, const Rays& b, double focal, double scale) {
  constexpr int iterations = 12;
  constexpr double difference = 1e-6;
  double damping = 1e-3;
  std::vector<double> errors = epipolar_errors(pose, a, b, focal);
  double cost = cauchy_cost(errors, scale);
  for (int k = 0; k < iterations; ++k) {
    Eigen::Matrix<double, Eigen::Dynamic, 5> jacobian(static_cast<Eigen::Index>(a.size()), 5);
    for (int j = 0; j < 5; ++j) {
      Eigen::Matrix<double, 5, 1> step = Eigen::Matrix<double, 5, 1>::Zero();
      step[j] = difference;
      const std::vector<double> near = epipolar_errors(moved(pose, step), a, b, focal);
      for (std::size_t i = 0; i < a.size(); ++i)
        jacobian(static_cast<Eigen::Index>(i), j) = (near[i] - errors[i]) / difference;
    }
    Eigen::Matrix<double, 5, 5> normal = Eigen::Matrix<double, 5, 5>::Zero();
    Eigen::Matrix<double, 5, 1> gradient = Eigen::Matrix<double, 5, 1>::Zero();
    for (std::size_t i = 0; i < a.size(); ++i) {
      const auto row = jacobian.row(static_cast<Eigen::Index>(i));
      const double weight = 1.0 / (1.0 + errors[i] * errors[i] / (scale * scale));
      normal += weight * row.transpose() * row;
      gradient += weight * errors[i] * row.transpose();
    }
    normal.diagonal() *= 1.0 + damping;
    normal.diagonal().array() += 1e-9;
    const Pose next = moved(pose, -normal.ldlt().solve(gradient));
    std::vector<double> next_errors = epipolar_errors(next, a, b, focal);
    const double next_cost = cauchy_cost(next_errors, scale);
    if (!(next_cost < cost)) {
      damping *= 10.0;
      if (damping > 1e3) break;
      continue;
    }
    const bool settled = cost - next_cost < 1e-5 * cost;
    pose = next;
    errors = std::move(next_errors);
    cost = next_cost;
    damping = std::max(1e-6, 0.1 * damping);
    if (settled) break;
  }
  return pose;
}

// Pixels between where a turn on the spot puts each ray and where it is seen.
std::vector<double> turn_errors(const Eigen::Quaterniond& turn, const Rays& a, const Rays& b, double focal) {
  std::vector<double> errors;
  errors.reserve(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Vector3d put = turn * a[i];
    errors.push_back(put.z() > 0 ? focal * (put.hnormalized() - b[i].hnormalized()).norm() : 1e6);
  }
  return errors;
}

// The turn between two bundles of rays (Kabsch 1976), reweighted so that those without parallax decide.
Eigen::Quaterniond turn_between(const Rays& a, const Rays& b, double focal, double scale) {
  constexpr int rounds = 5;
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  std::vector<double> weights(a.size(), 1.0);
  for (int k = 0; k < rounds; ++k) {
    Matrix3d moment = Matrix3d::Zero();
    for (std::size_t i = 0; i < a.size(); ++i) moment += weights[i] * b[i].normalized() * a[i].normalized().transpose();
    const Eigen::JacobiSVD<Matrix3d> svd(moment, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Vector3d signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1);
    turn = Eigen::Quaterniond(Matrix3d(svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose()));
    const std::vector<double> errors = turn_errors(turn, a, b, focal);
    for (std::size_t i = 0; i < a.size(); ++i) weights[i] = 1.0 / (1.0 + errors[i] * errors[i] / (scale * scale));
  }
  return turn;
}

double share_within(const std::vector<double>& errors, double limit) {
  const auto within = std::count_if(errors.begin(), errors.end(), [&](double e) { return std::abs(e) <= limit; });
  return static_cast<double>(within) / static_cast<double>(errors.size());
}

// Depth of a ray in a, and in b, where the two rays come closest.
std::pair<double, double> depths(const Pose& b_from_a, const Vector3d& a, const Vector3d& b) {
  const Vector3d turned = b_from_a.rotation * a;
  Eigen::Matrix<double, 3, 2> rays;
  rays << turned, -b;
  const Vector2d z = (rays.transpose() * rays).ldlt().solve(-rays.transpose() * b_from_a.translation);
  return {z[0], z[1]};
}

// Scale of the loss that suits the matches at a pose: most are far more exact than `noise`, and those at the subject's
// outline, which moves over it, are only told from them by a narrow loss.
double suited_scale(const Pose& pose, const Rays& a, const Rays& b, double focal, double noise) {
  std::vector<double> errors = epipolar_errors(pose, a, b, focal);
  for (double& e : errors) e = std::abs(e);
  return std::clamp(1.5 * median(std::move(errors)), 0.15 * noise, noise);
}

std::optional<Pose> five_point_pose(const Rays& a, const Rays& b, double focal, double limit) {
  std::vector<cv::Point2d> from, to;
  for (std::size_t i = 0; i < a.size(); ++i) {
    from.emplace_back(a[i].x(), a[i].y());
    to.emplace_back(b[i].x(), b[i].y());
  }
  constexpr double confidence = 0.999;
  cv::Mat mask, one, other, translation;
  const cv::Mat essential =
      cv::findEssentialMat(from, to, 1.0, cv::Point2d(0, 0), cv::RANSAC, confidence, limit / focal, mask);
  if (essential.rows != 3 || essential.cols != 3) return std::nullopt;
  cv::decomposeEssentialMat(essential, one, other, translation);
  const auto quaternion = [](const cv::Mat& rotation) {
    Matrix3d r;
    for (int y = 0; y < 3; ++y) {
      for (int x = 0; x < 3; ++x) r(y, x) = rotation.at<double>(y, x);
    }
    return Eigen::Quaterniond(r);
  };
  // The other rotation is half a turn about the translation away, which nobody makes between two frames.
  const Eigen::Quaterniond a_turn = quaternion(one);
  const Eigen::Quaterniond b_turn = quaternion(other);
  const Vector3d t(translation.at<double>(0), translation.at<double>(1), translation.at<double>(2));
  return Pose{std::abs(a_turn.w()) > std::abs(b_turn.w()) ? a_turn : b_turn, t.normalized()};
}

}  // namespace

std::optional<RelativePose> relative_pose(std::span<const Vector2d> a_pixels, std::span<const Vector2d> b_pixels,
                                          const Camera& camera, const RelativePoseOptions& options) {
  if (static_cast<double>(a_pixels.size()) < options.least_inliers) return std::nullopt;
  const Rays a = rays_of(a_pixels, camera);
  const Rays b = rays_of(b_pixels, camera);
  const double focal = 0.5 * (camera.fx + camera.fy);
  const double limit = 3.0 * options.noise;

  RelativePose out;
  out.depth.assign(a.size(), 0.0);
  const Eigen::Quaterniond turn = turn_between(a, b, focal, options.noise);
  out.error = turn_errors(turn, a, b, focal);
  constexpr double nearly_all = 0.9;
  if (share_within(out.error, limit) >= nearly_all) {
    out.b_from_a.rotation = turn;
    return out;
  }

  std::optional<Pose> pose = five_point_pose(a, b, focal, options.noise);
  if (!pose) return std::nullopt;
  for (int round = 0; round < 2; ++round)
    pose = refined(*pose, a, b, focal, suited_scale(*pose, a, b, focal, options.noise));
  out.error = epipolar_errors(*pose, a, b, focal);
  const double share = share_within(out.error, limit);
  if (share < options.min_share || share * static_cast<double>(a.size()) < options.least_inliers) return std::nullopt;

  int in_front = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    out.error[i] = std::abs(out.error[i]);
    if (out.error[i] > limit) continue;
    const auto [in_a, in_b] = depths(*pose, a[i], b[i]);
    if (in_a > 0 && in_b > 0) ++in_front;
    if (in_a < 0 && in_b < 0) --in_front;
    out.depth[i] = in_a;
  }
  // Both directions of the translation explain the rays; most points lie before the camera in one of them.
  if (in_front < 0) {
    pose->translation = -pose->translation;
    for (double& depth : out.depth) depth = -depth;
  }
  for (double& depth : out.depth) depth = std::max(0.0, depth);
  out.b_from_a = *pose;
  return out;
}

}  // namespace gyre
