// SPDX-License-Identifier: Apache-2.0
// The analytic derivatives against differences.
#include "offload/body/body_jacobian.h"

#include <gtest/gtest.h>
#include <random>

namespace gyre {
namespace {

BodyState random_state(const BodyTemplate& body, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  BodyState state = rest_state(body);
  state.scale = 1.1;
  state.pose.translation = {0.3, -0.2, 0.5};
  for (Eigen::Vector3d& r : state.pose.rotations)
    r = 0.3 * Eigen::Vector3d(uniform(random), uniform(random), uniform(random));
  state.pose.rotations[0].y() = 2.0;
  for (Eigen::Index s = 0; s < state.shape.size(); ++s) state.shape[s] = uniform(random);
  state.head = Eigen::VectorXd::Constant(1, 0.7);
  state.expression = Eigen::Vector2d(0, 0.4);
  return state;
}

TEST(BodyJacobian, AgreesWithDifferences) {
  BodyTemplate body = built_in_template();
  std::vector<int> vertices;
  for (std::size_t v = 5; v < body.skin.size(); v += body.skin.size() / 12) vertices.push_back(static_cast<int>(v));
  // A head shape and an expression that move joints' vertices and the tested ones.
  Morph morph{"morph", vertices, {}};
  for (const auto& [vertex, weight] : body.joints[body.joint_index("head")].regressor)
    if (std::find(morph.vertices.begin(), morph.vertices.end(), vertex) == morph.vertices.end())
      morph.vertices.push_back(vertex);
  for (std::size_t i = 0; i < morph.vertices.size(); ++i)
    morph.offsets.emplace_back(0.01F * static_cast<float>(i % 5), -0.02F, 0.01F);
  body.head_shapes = {morph};
  body.expressions = {morph, morph};
  const BodyState state = random_state(body, 3);
  const PosedBody posed = evaluate(body, state);
  std::vector<int> joints(body.joints.size());
  std::iota(joints.begin(), joints.end(), 0);
  BodyJacobian jacobian(body, joints, static_cast<int>(body.shapes.size()), 1, {1});
  jacobian.linearise(state, posed);
  std::vector<Eigen::Matrix3Xd> analytic(vertices.size(), Eigen::Matrix3Xd::Zero(3, jacobian.parameters()));
  for (std::size_t i = 0; i < vertices.size(); ++i) jacobian.add_vertex(vertices[i], 1.0, analytic[i]);
  constexpr double h = 1e-5;
  for (int p = 0; p < jacobian.parameters(); ++p) {
    const Eigen::VectorXd step = h * Eigen::VectorXd::Unit(jacobian.parameters(), p);
    const PosedBody ahead = evaluate(body, jacobian.stepped(state, step));
    const PosedBody behind = evaluate(body, jacobian.stepped(state, -step));
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      const Eigen::Vector3d numeric = (ahead.vertices[vertices[i]] - behind.vertices[vertices[i]]) / (2 * h);
      EXPECT_LT((numeric - analytic[i].col(p)).norm(), 1e-5) << "parameter " << p << " vertex " << vertices[i];
    }
  }
}

}  // namespace
}  // namespace gyre
