// SPDX-License-Identifier: Apache-2.0
// The body in Ceres: points of its surface by pose, size, shape, head and expression, with exact derivatives.
#pragma once

#include "offload/body/body_jacobian.h"

#include <ceres/cost_function.h>
#include <Eigen/Core>
#include <array>
#include <vector>

namespace gyre {

// A point of the surface (corners of a triangle and barycentric weights) and where it should be.
struct SurfaceTarget {
  std::array<int, 3> corners{};
  Eigen::Vector3d weights = Eigen::Vector3d::UnitX();
  Eigen::Vector3d position = Eigen::Vector3d::Zero();              // metres, world
  Eigen::Matrix3d sqrt_information = Eigen::Matrix3d::Identity();  // whitens the difference; 1 / metres
};

// Residuals sqrt_information * (point - position), three a target. Parameter blocks, in this order, those of size 0
// left out: translation (3), logarithm of the scale (1), rotation vectors of the free joints (3 each, one block),
// shape, head, expressions. Everything else is as in `base`. Derivatives are those of BodyJacobian, its turns from the
// left brought to rotation vectors by the left Jacobian of SO(3) (Sola, Deray, Atchuthan, "A micro Lie theory", 2018,
// eq. 145).
class BodyCost final : public ceres::CostFunction {
 public:
  // body must outlive the cost.
  BodyCost(const BodyTemplate& body, const BodyState& base, std::vector<int> free_joints, int shape_count,
           int head_count, std::vector<int> expressions, std::vector<SurfaceTarget> targets);

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

  // Values of the blocks at a state, and the state for values of the blocks.
  std::vector<std::vector<double>> blocks(const BodyState& state) const;
  BodyState state(double const* const* blocks) const;

 private:
  const BodyTemplate& body_;
  BodyState base_;
  mutable BodyJacobian jacobian_;  // linearised by Evaluate(), which Ceres runs once at a time for a residual block
  std::vector<SurfaceTarget> targets_;
};

// What joints turn beyond their ranges, over `spread` radians: three residuals a joint. One block: the joints' rotation
// vectors one after the other, as BodyCost has them.
class JointRangeCost final : public ceres::CostFunction {
 public:
  JointRangeCost(std::vector<JointRange> ranges, double spread);

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  std::vector<JointRange> ranges_;
  double spread_;
};

}  // namespace gyre
