// SPDX-License-Identifier: Apache-2.0
// What is known about a standing person's joints before looking: spreads around a pose, and limits.
#pragma once

#include "offload/body/template.h"

#include <Eigen/Core>
#include <string_view>
#include <vector>

namespace gyre {

// Bounds of a rotation vector's component along an axis, radians.
struct JointLimit {
  int joint = 0;
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();
  double least = 0.0;
  double most = 0.0;
};

// Gaussian around a mean rotation vector for each free joint, and one-sided limits.
struct PosePrior {
  std::vector<int> joints;               // the free ones, parents first
  std::vector<Eigen::Vector3d> means;    // radians
  std::vector<Eigen::Vector3d> spreads;  // standard deviations about the axes of the rest pose, radians
  std::vector<JointLimit> limits;
};

// Main joints of somebody standing in `start`: trunk nearly straight, knees and elbows bend one way only, hands and
// feet near the limb's own direction. The heading is free.
PosePrior standing_prior(const BodyTemplate& body, const BodyPose& start);

// Adds the prior's normal equations at `pose` to hessian and gradient; rotation step k of joints[k] sits at
// first_column + 3 k and multiplies from the left. `limit_spread`: radians by which a limit may be passed.
void add_prior(const PosePrior& prior, const BodyPose& pose, int first_column, double limit_spread,
               Eigen::MatrixXd& hessian, Eigen::VectorXd& gradient);

}  // namespace gyre
