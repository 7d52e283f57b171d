// SPDX-License-Identifier: Apache-2.0
#include "device/analysis/window_adjustment.h"

#include "common/geometry/quantile.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace gyre {

namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Matrix23 = Eigen::Matrix<double, 2, 3>;
using Matrix26 = Eigen::Matrix<double, 2, 6>;
using Matrix63 = Eigen::Matrix<double, 6, 3>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

constexpr double nearest = 1e-3;  // depth of a point that still counts as before the camera

// Residual of a sighting, its derivatives by the camera's step (turn, then shift, applied on the left) and by the
// point, and its Cauchy weight.
struct Linearised {
  Vector2d residual;
  Matrix26 by_pose;
  Matrix23 by_point;
  double weight = 0.0;
};

bool linearise(const Pose& pose, const Vector3d& point, const Vector2d& at, double scale, Linearised& out) {
  const Vector3d x = pose * point;
  if (x.z() < nearest) return false;
  out.residual = x.hnormalized() - at;
  Matrix23 projection;
  projection << 1 / x.z(), 0, -x.x() / (x.z() * x.z()), 0, 1 / x.z(), -x.y() / (x.z() * x.z());
  Matrix3d cross;
  cross << 0, -x.z(), x.y(), x.z(), 0, -x.x(), -x.y(), x.x(), 0;
  out.by_pose << -projection * cross, projection;
  out.by_point = projection * pose.rotation.toRotationMatrix();
  out.weight = 1.0 / (1.0 + out.residual.squaredNorm() / (scale * scale));
  return true;
}

Pose stepped(const Pose& pose, const Vector6& step) {
  const Eigen::Quaterniond turn = rotation_about(step.head<3>());
  return {(turn * pose.rotation).normalized(), turn * pose.translation + step.tail<3>()};
}

double loss(const Pose& pose, const Vector3d& point, const Vector2d& at, double scale) {
  constexpr double behind = 10.0;
  const double error = reprojection_error(pose, point, at);
  return std::isfinite(error) ? std::log1p(error * error / (scale * scale)) : behind;
}

double total_loss(std::span<const WindowView> views, std::span<const Vector3d> points, const std::vector<int>& seen,
                  double scale) {
  double sum = 0.0;
  for (const WindowView& view : views) {
    for (const Sighting& sighting : view.sightings) {
      const auto p = static_cast<std::size_t>(sighting.point);
      if (seen[p] >= 2) sum += loss(view.cam_from_world, points[p], sighting.at, scale);
    }
  }
  return sum;
}

// The normal equations of a window, by blocks.
struct Normal {
  MatrixXd poses;  // 6 n x 6 n
  VectorXd pose_gradient;
  std::vector<Matrix3d> points;
  std::vector<Vector3d> point_gradients;
  std::vector<std::vector<std::pair<int, Matrix63>>> mixed;  // of each point: view (free ones only), block
};

Normal normal_equations(std::span<const WindowView> views, std::size_t fixed, std::span<const Vector3d> points,
                        const std::vector<int>& seen, double scale) {
  Normal n;
  const auto size = static_cast<Eigen::Index>(6 * (views.size() - fixed));
  n.poses = MatrixXd::Zero(size, size);
  n.pose_gradient = VectorXd::Zero(size);
  n.points.assign(points.size(), Matrix3d::Zero());
  n.point_gradients.assign(points.size(), Vector3d::Zero());
  n.mixed.resize(points.size());
  Linearised l;
  for (std::size_t v = 0; v < views.size(); ++v) {
    for (const Sighting& sighting : views[v].sightings) {
      const auto p = static_cast<std::size_t>(sighting.point);
      if (seen[p] < 2 || !linearise(views[v].cam_from_world, points[p], sighting.at, scale, l)) continue;
      n.points[p] += l.weight * l.by_point.transpose() * l.by_point;
      n.point_gradients[p] += l.weight * l.by_point.transpose() * l.residual;
      if (v < fixed) continue;
      const auto at = static_cast<Eigen::Index>(6 * (v - fixed));
      n.poses.block<6, 6>(at, at) += l.weight * l.by_pose.transpose() * l.by_pose;
      n.pose_gradient.segment<6>(at) += l.weight * l.by_pose.transpose() * l.residual;
      n.mixed[p].emplace_back(static_cast<int>(v - fixed), l.weight * l.by_pose.transpose() * l.by_point);
    }
  }
  return n;
}

// Solves the damped equations; steps of the free views and of the points.
void solve(const Normal& n, double damping, VectorXd& pose_step, std::vector<Vector3d>& point_steps) {
  constexpr double floor = 1e-9;
  MatrixXd reduced = n.poses;
  reduced.diagonal() *= 1.0 + damping;
  reduced.diagonal().array() += floor;
  VectorXd right = -n.pose_gradient;
  std::vector<Matrix3d> inverses(n.points.size());
  for (std::size_t p = 0; p < n.points.size(); ++p) {
    Matrix3d block = n.points[p];
    block.diagonal() *= 1.0 + damping;
    block.diagonal().array() += floor;
    inverses[p] = block.inverse();
    for (const auto& [i, b] : n.mixed[p]) {
      const Matrix63 through = b * inverses[p];
      right.segment<6>(6 * i) += through * n.point_gradients[p];
      for (const auto& [j, c] : n.mixed[p]) reduced.block<6, 6>(6 * i, 6 * j) -= through * c.transpose();
    }
  }
  pose_step = reduced.ldlt().solve(right);
  point_steps.assign(n.points.size(), Vector3d::Zero());
  for (std::size_t p = 0; p < n.points.size(); ++p) {
    Vector3d side = -n.point_gradients[p];
    for (const auto& [i, b] : n.mixed[p]) side -= b.transpose() * pose_step.segment<6>(6 * i);
    point_steps[p] = inverses[p] * side;
  }
}

// Scale of the loss: 1.5 times the median error, within the bounds.
double suited_scale(std::vector<double> errors, const AdjustmentOptions& options) {
  if (errors.empty()) return options.largest_scale;
  return std::clamp(1.5 * median(std::move(errors)), options.least_scale, options.largest_scale);
}

}  // namespace

double reprojection_error(const Pose& cam_from_world, const Vector3d& point, const Vector2d& at) {
  const Vector3d x = cam_from_world * point;
  return x.z() < nearest ? std::numeric_limits<double>::infinity() : (x.hnormalized() - at).norm();
}

void adjust_window(std::span<WindowView> views, std::size_t fixed, std::span<Vector3d> points,
                   const AdjustmentOptions& options) {
  std::vector<int> seen(points.size(), 0);
  for (const WindowView& view : views) {
    for (const Sighting& sighting : view.sightings) ++seen[static_cast<std::size_t>(sighting.point)];
  }
  std::vector<double> errors;
  for (const WindowView& view : views) {
    for (const Sighting& s : view.sightings) {
      const auto p = static_cast<std::size_t>(s.point);
      if (seen[p] >= 2) errors.push_back(reprojection_error(view.cam_from_world, points[p], s.at));
    }
  }
  const double scale = suited_scale(std::move(errors), options);
  double cost = total_loss(views, points, seen, scale);
  double damping = 1e-4;
  for (int k = 0; k < options.iterations; ++k) {
    const Normal normal = normal_equations(views, fixed, points, seen, scale);
    VectorXd pose_step;
    std::vector<Vector3d> point_steps;
    solve(normal, damping, pose_step, point_steps);
    std::vector<WindowView> next(views.begin(), views.end());
    std::vector<Vector3d> next_points(points.begin(), points.end());
    for (std::size_t v = fixed; v < views.size(); ++v) {
      const auto at = static_cast<Eigen::Index>(6 * (v - fixed));
      next[v].cam_from_world = stepped(views[v].cam_from_world, pose_step.segment<6>(at));
    }
    for (std::size_t p = 0; p < points.size(); ++p) {
      if (seen[p] >= 2) next_points[p] += point_steps[p];
    }
    const double next_cost = total_loss(next, next_points, seen, scale);
    if (!(next_cost < cost)) {
      damping *= 10.0;
      continue;
    }
    const bool settled = cost - next_cost < 1e-5 * cost;
    std::copy(next.begin(), next.end(), views.begin());
    std::copy(next_points.begin(), next_points.end(), points.begin());
    cost = next_cost;
    damping = std::max(1e-7, 0.1 * damping);
    if (settled) break;
  }
}

Pose resected(Pose pose, std::span<const Sighting> sightings, std::span<const Vector3d> points,
              const AdjustmentOptions& options) {
  double scale = options.largest_scale;
  const auto cost_of = [&](const Pose& at) {
    double sum = 0.0;
    for (const Sighting& s : sightings) sum += loss(at, points[static_cast<std::size_t>(s.point)], s.at, scale);
    return sum;
  };
  // First with the widest loss, as the prediction may be far off, then with the one that suits the errors.
  for (int round = 0; round < 2; ++round) {
    double cost = cost_of(pose);
    double damping = 1e-4;
    for (int k = 0; k < options.iterations; ++k) {
      Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
      Vector6 gradient = Vector6::Zero();
      Linearised l;
      for (const Sighting& s : sightings) {
        if (!linearise(pose, points[static_cast<std::size_t>(s.point)], s.at, scale, l)) continue;
        normal += l.weight * l.by_pose.transpose() * l.by_pose;
        gradient += l.weight * l.by_pose.transpose() * l.residual;
      }
      normal.diagonal() *= 1.0 + damping;
      normal.diagonal().array() += 1e-9;
      const Pose next = stepped(pose, -normal.ldlt().solve(gradient));
      const double next_cost = cost_of(next);
      if (!(next_cost < cost)) {
        damping *= 10.0;
        continue;
      }
      const bool settled = cost - next_cost < 1e-5 * cost;
      pose = next;
      cost = next_cost;
      damping = std::max(1e-7, 0.1 * damping);
      if (settled) break;
    }
    std::vector<double> errors;
    for (const Sighting& s : sightings)
      errors.push_back(reprojection_error(pose, points[static_cast<std::size_t>(s.point)], s.at));
    scale = suited_scale(std::move(errors), options);
  }
  return pose;
}

}  // namespace gyre
