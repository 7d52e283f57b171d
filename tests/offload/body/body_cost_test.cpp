// SPDX-License-Identifier: Apache-2.0
// The body in Ceres: derivatives against differences, and a state that is found again.
#include "offload/body/body_cost.h"

#include "offload/body/joint_range.h"

#include <ceres/problem.h>
#include <ceres/solver.h>
#include <gtest/gtest.h>
#include <random>

namespace gyre {
namespace {

BodyTemplate human() {
  BodyTemplate body = built_in_template();
  Morph morph{"morph", {}, {}};
  for (int v = 0; v < static_cast<int>(body.skin.size()); v += 3) {
    morph.vertices.push_back(v);
    morph.offsets.emplace_back(0.01F * static_cast<float>(v % 5), -0.02F, 0.01F * static_cast<float>(v % 3));
  }
  body.head_shapes = {morph};
  body.expressions = {morph, morph};
  return body;
}

BodyState state_of(const BodyTemplate& body, std::uint64_t seed, double turn) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  BodyState state = rest_state(body);
  state.scale = 1.1;
  state.pose.translation = {0.2, -0.1, 0.3};
  for (auto& r : state.pose.rotations) r = turn * Eigen::Vector3d(uniform(random), uniform(random), uniform(random));
  for (double& s : state.shape) s = uniform(random);
  state.head = Eigen::VectorXd::Constant(1, 0.4);
  state.expression = Eigen::Vector2d(0.1, 0.3);
  return state;
}

std::vector<SurfaceTarget> targets_on(const BodyTemplate& body, const PosedBody& posed, std::size_t step) {
  std::vector<SurfaceTarget> targets;
  for (std::size_t t = 0; t < body.mesh.triangles.size(); t += step) {
    SurfaceTarget target;
    target.weights = {0.2, 0.3, 0.5};
    for (int c = 0; c < 3; ++c) {
      target.corners[c] = body.mesh.triangles[t][c];
      target.position += target.weights[c] * posed.vertices[target.corners[c]];
    }
    target.sqrt_information = Eigen::Vector3d(1, 2, 3).asDiagonal();
    targets.push_back(target);
  }
  return targets;
}

std::vector<const double*> pointers(const std::vector<std::vector<double>>& blocks) {
  std::vector<const double*> all;
  for (const auto& block : blocks) all.push_back(block.data());
  return all;
}

TEST(BodyCost, DerivativesAgreeWithDifferences) {
  const BodyTemplate body = human();
  const std::vector<int> joints = {0, body.joint_index("spine"), body.joint_index("leftUpperArm"),
                                   body.joint_index("leftLowerArm"), body.joint_index("rightLowerLeg")};
  const BodyState state = state_of(body, 1, 0.8);
  const BodyCost cost(body, state, joints, 2, 1, {1}, targets_on(body, evaluate(body, rest_state(body)), 700));
  auto blocks = cost.blocks(state);
  ASSERT_EQ(blocks.size(), 6U);
  const int rows = cost.num_residuals();
  std::vector<std::vector<double>> slopes;
  std::vector<double*> slope_pointers;
  for (const auto& block : blocks) slopes.emplace_back(static_cast<std::size_t>(rows) * block.size());
  for (auto& slope : slopes) slope_pointers.push_back(slope.data());
  std::vector<double> residuals(rows), ahead(rows), behind(rows);
  ASSERT_TRUE(cost.Evaluate(pointers(blocks).data(), residuals.data(), slope_pointers.data()));
  constexpr double h = 1e-6;
  for (std::size_t b = 0; b < blocks.size(); ++b)
    for (std::size_t i = 0; i < blocks[b].size(); ++i) {
      const double kept = blocks[b][i];
      blocks[b][i] = kept + h;
      cost.Evaluate(pointers(blocks).data(), ahead.data(), nullptr);
      blocks[b][i] = kept - h;
      cost.Evaluate(pointers(blocks).data(), behind.data(), nullptr);
      blocks[b][i] = kept;
      for (int r = 0; r < rows; ++r)
        ASSERT_NEAR(slopes[b][static_cast<std::size_t>(r) * blocks[b].size() + i], (ahead[r] - behind[r]) / (2 * h),
                    1e-6)
            << "block " << b << " parameter " << i << " residual " << r;
    }
}

TEST(BodyCost, CeresFindsTheState) {
  const BodyTemplate body = human();
  const std::vector<int> joints = {0, body.joint_index("leftUpperArm"), body.joint_index("rightUpperLeg")};
  BodyState truth = rest_state(body);
  truth.pose.translation = {0.1, 0.02, -0.2};
  truth.scale = 1.05;
  truth.pose.rotations[0] = {0.1, 0.5, 0};
  truth.pose.rotations[joints[1]] = {0, 0.2, -0.3};
  truth.shape[0] = 0.8;
  truth.shape[1] = -0.6;
  const BodyState start = rest_state(body);
  auto* cost = new BodyCost(body, start, joints, 2, 0, {}, targets_on(body, evaluate(body, truth), 40));
  auto blocks = cost->blocks(start);
  ceres::Problem problem;
  std::vector<double*> parameters;
  for (auto& block : blocks) parameters.push_back(block.data());
  problem.AddResidualBlock(cost, nullptr, parameters);
  ceres::Solver::Options options;
  options.max_num_iterations = 50;
  options.function_tolerance = 1e-14;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  const BodyState found = cost->state(pointers(blocks).data());
  const PosedBody expected = evaluate(body, truth), got = evaluate(body, found);
  for (std::size_t v = 0; v < got.vertices.size(); v += 11)
    ASSERT_LT((got.vertices[v] - expected.vertices[v]).norm(), 1e-4);
}

TEST(JointRangeCost, PushesBackOnlyBeyondTheRange) {
  const BodyTemplate body = built_in_template();
  const JointRange range = body.joints[body.joint_index("leftLowerLeg")].range;
  const JointRangeCost cost({range, range}, 0.1);
  const Eigen::Vector3d bend = range.axes.col(1);
  Eigen::VectorXd rotations(6), residuals(6), ahead(6);
  rotations << 0.5 * range.least[1] * bend, (range.most[1] + 0.2) * bend;
  Eigen::Matrix<double, 6, 6, Eigen::RowMajor> slope;
  const double* parameters = rotations.data();
  double* slopes = slope.data();
  ASSERT_TRUE(cost.Evaluate(&parameters, residuals.data(), &slopes));
  EXPECT_TRUE(residuals.head<3>().isZero(1e-12));
  EXPECT_NEAR(residuals.tail<3>().norm(), 2, 1e-9);
  for (Eigen::Index i = 0; i < 6; ++i) {
    constexpr double h = 1e-6;
    rotations[i] += h;
    cost.Evaluate(&parameters, ahead.data(), nullptr);
    rotations[i] -= h;
    EXPECT_LT((slope.col(i) - (ahead - residuals) / h).norm(), 1e-6);
  }
}

}  // namespace
}  // namespace gyre
