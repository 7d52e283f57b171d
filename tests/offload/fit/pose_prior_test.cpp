// SPDX-License-Identifier: Apache-2.0
#include "offload/fit/pose_prior.h"

#include "offload/body/body_state.h"

#include <gtest/gtest.h>
#include <random>

namespace gyre {
namespace {

TEST(PosePrior, GradientVanishesAtTheMeanAndLimitsPushBack) {
  const BodyTemplate body = built_in_template();
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> uniform(-0.3, 0.3);
  BodyState state = rest_state(body);
  for (Eigen::Vector3d& r : state.pose.rotations) r = {uniform(random), uniform(random), uniform(random)};
  PosePrior prior = standing_prior(body, state.pose);
  prior.limits.clear();
  const auto size = static_cast<Eigen::Index>(3 * prior.joints.size());
  Eigen::MatrixXd hessian = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(size);
  add_prior(prior, state.pose, 0, 0.03, hessian, gradient);
  EXPECT_LT(gradient.norm(), 1e-12);

  // A knee bent forwards by 0.4 rad is pushed back.
  const int knee = body.joint_index("leftLowerLeg");
  BodyPose straight = rest_state(body).pose;
  prior = standing_prior(body, straight);
  straight.rotations[knee] = {-0.4, 0, 0};
  hessian.setZero();
  gradient.setZero();
  add_prior(prior, straight, 0, 0.03, hessian, gradient);
  const auto slot = std::find(prior.joints.begin(), prior.joints.end(), knee) - prior.joints.begin();
  EXPECT_LT(gradient[3 * slot], -100.0);
}

}  // namespace
}  // namespace gyre
