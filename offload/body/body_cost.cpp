// SPDX-License-Identifier: Apache-2.0
#include "offload/body/body_cost.h"

#include "offload/body/joint_range.h"

#include <cmath>

namespace gyre {
namespace {

Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& r) {
  Eigen::Matrix3d cross;
  cross << 0, -r.z(), r.y(), r.z(), 0, -r.x(), -r.y(), r.x(), 0;
  const double angle = r.norm();
  if (angle < 1e-5) return Eigen::Matrix3d::Identity() + 0.5 * cross + cross * cross / 6;
  return Eigen::Matrix3d::Identity() + (1 - std::cos(angle)) / (angle * angle) * cross +
         (angle - std::sin(angle)) / (angle * angle * angle) * cross * cross;
}

}  // namespace

BodyCost::BodyCost(const BodyTemplate& body, const BodyState& base, std::vector<int> free_joints, int shape_count,
                   int head_count, std::vector<int> expressions, std::vector<SurfaceTarget> targets)
    : body_(body),
      base_(base),
      jacobian_(body, std::move(free_joints), shape_count, head_count, std::move(expressions)),
      targets_(std::move(targets)) {
  set_num_residuals(3 * static_cast<int>(targets_.size()));
  for (int size : {3, 1, 3 * static_cast<int>(jacobian_.free_joints().size()), shape_count, head_count,
                   static_cast<int>(jacobian_.expressions().size())})
    if (size > 0) mutable_parameter_block_sizes()->push_back(size);
}

BodyState BodyCost::state(double const* const* blocks) const {
  BodyState state = base_;
  int block = 0;
  state.pose.translation = Eigen::Map<const Eigen::Vector3d>(blocks[block++]);
  state.scale = std::exp(*blocks[block++]);
  if (const auto& joints = jacobian_.free_joints(); !joints.empty()) {
    for (std::size_t i = 0; i < joints.size(); ++i)
      state.pose.rotations[joints[i]] = Eigen::Map<const Eigen::Vector3d>(blocks[block] + 3 * i);
    ++block;
  }
  const auto set = [&](Eigen::VectorXd& values, int at, double value) {
    if (values.size() <= at) values.conservativeResizeLike(Eigen::VectorXd::Zero(at + 1));
    values[at] = value;
  };
  if (jacobian_.shape_count() > 0) {
    for (int s = 0; s < jacobian_.shape_count(); ++s) set(state.shape, s, blocks[block][s]);
    ++block;
  }
  if (jacobian_.head_count() > 0) {
    for (int s = 0; s < jacobian_.head_count(); ++s) set(state.head, s, blocks[block][s]);
    ++block;
  }
  for (std::size_t e = 0; e < jacobian_.expressions().size(); ++e)
    set(state.expression, jacobian_.expressions()[e], blocks[block][e]);
  return state;
}

std::vector<std::vector<double>> BodyCost::blocks(const BodyState& state) const {
  const Eigen::Vector3d& translation = state.pose.translation;
  std::vector<std::vector<double>> blocks = {{translation.x(), translation.y(), translation.z()},
                                             {std::log(state.scale)}};
  const auto value = [](const Eigen::VectorXd& values, int at) { return at < values.size() ? values[at] : 0.0; };
  std::vector<double> rotations, shape, head, expression;
  for (int joint : jacobian_.free_joints())
    for (int axis = 0; axis < 3; ++axis) rotations.push_back(state.pose.rotations[joint][axis]);
  for (int s = 0; s < jacobian_.shape_count(); ++s) shape.push_back(value(state.shape, s));
  for (int s = 0; s < jacobian_.head_count(); ++s) head.push_back(value(state.head, s));
  for (int e : jacobian_.expressions()) expression.push_back(value(state.expression, e));
  for (auto* more : {&rotations, &shape, &head, &expression})
    if (!more->empty()) blocks.push_back(*more);
  return blocks;
}

bool BodyCost::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  const BodyState now = state(parameters);
  const PosedBody posed = evaluate(body_, now);
  BodyJacobian& jacobian = jacobian_;
  jacobian.linearise(now, posed);
  Eigen::Matrix3Xd slope(3, jacobian.parameters());
  for (std::size_t i = 0; i < targets_.size(); ++i) {
    const SurfaceTarget& target = targets_[i];
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    slope.setZero();
    for (int c = 0; c < 3; ++c) {
      if (target.weights[c] == 0) continue;
      point += target.weights[c] * posed.vertices[target.corners[c]];
      if (jacobians) jacobian.add_vertex(target.corners[c], target.weights[c], slope);
    }
    Eigen::Map<Eigen::Vector3d>(residuals + 3 * i) = target.sqrt_information * (point - target.position);
    if (!jacobians) continue;
    const auto& joints = jacobian.free_joints();
    for (std::size_t k = 0; k < joints.size(); ++k) {
      auto turn = slope.middleCols<3>(jacobian.joint_column(static_cast<int>(k)));
      turn = (turn * left_jacobian(now.pose.rotations[joints[k]])).eval();
    }
    Eigen::Index column = 0;
    for (std::size_t b = 0; b < parameter_block_sizes().size(); ++b) {
      const int size = parameter_block_sizes()[b];
      if (jacobians[b]) {
        using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
        Eigen::Map<RowMajor>(jacobians[b], num_residuals(), size).middleRows<3>(3 * static_cast<Eigen::Index>(i)) =
            target.sqrt_information * slope.middleCols(column, size);
      }
      column += size;
    }
  }
  return true;
}

JointRangeCost::JointRangeCost(std::vector<JointRange> ranges, double spread)
    : ranges_(std::move(ranges)), spread_(spread) {
  const int size = 3 * static_cast<int>(ranges_.size());
  set_num_residuals(size);
  mutable_parameter_block_sizes()->push_back(size);
}

bool JointRangeCost::Evaluate(double const* const* parameters, double* residuals, double** jacobians) const {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  const bool with_slope = jacobians && jacobians[0];
  if (with_slope) std::fill_n(jacobians[0], num_residuals() * num_residuals(), 0.0);
  for (std::size_t j = 0; j < ranges_.size(); ++j) {
    const auto at = 3 * static_cast<Eigen::Index>(j);
    const Eigen::Vector3d outside = beyond(ranges_[j], Eigen::Map<const Eigen::Vector3d>(parameters[0] + at));
    Eigen::Map<Eigen::Vector3d>(residuals + at) = outside / spread_;
    if (!with_slope) continue;
    Eigen::Map<RowMajor> slope(jacobians[0], num_residuals(), num_residuals());
    for (int axis = 0; axis < 3; ++axis)
      if (outside[axis] != 0) slope.block<1, 3>(at + axis, at) = ranges_[j].axes.col(axis).transpose() / spread_;
  }
  return true;
}

}  // namespace gyre
