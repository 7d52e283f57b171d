// SPDX-License-Identifier: Apache-2.0
// Exact derivatives of a skinned vertex by translation, size, joint rotations, shape, head and expression.
#pragma once

#include "offload/body/body_state.h"

#include <Eigen/Core>
#include <vector>

namespace gyre {

// Parameters of one step, in this order: 3 translation (metres), 1 logarithm of the scale, 3 a free joint, 1 a shape, 1
// a head shape, 1 an expression.
// A joint's step d turns it as exp(d) R, with R its rotation so far.
//
// For a vertex x = sum_j w_j T_j v of linear blend skinning:
//   by the turn of joint k:   sum over influences j below k of w_j (exp(G d) - 1)(T_j v - p_k), G the rotation of k's
//                             parent, p_k the joint's place;
//   by the shape:             sum_j w_j (G_j s (B_v - B_j) + dp_j), B_v and B_j the shape's offset of the vertex and of
//                             the joint, dp_j the joint's own motion handed down the chain; of an expression B_j = 0;
//   by the scale:             x - translation, as everything else grows about the origin.
class BodyJacobian {
 public:
  // free_joints: indices into body.joints. shape_count, head_count: the first ones that may change. expressions:
  // indices into body.expressions.
  BodyJacobian(const BodyTemplate& body, std::vector<int> free_joints, int shape_count, int head_count = 0,
               std::vector<int> expressions = {});

  int parameters() const { return shape_column() + morph_count(); }
  int joint_column(int free_joint) const { return 4 + 3 * free_joint; }
  int shape_column() const { return 4 + 3 * static_cast<int>(free_joints_.size()); }
  const std::vector<int>& free_joints() const { return free_joints_; }
  int shape_count() const { return shape_count_; }
  int head_column() const { return shape_column() + shape_count_; }
  int head_count() const { return head_count_; }
  int expression_column() const { return head_column() + head_count_; }
  const std::vector<int>& expressions() const { return expressions_; }

  // Prepares for vertices of `posed`, which must be evaluate(body, state); both must outlive the calls of add_vertex.
  void linearise(const BodyState& state, const PosedBody& posed);

  // jacobian (3 x parameters) += weight * d vertex / d parameters.
  void add_vertex(int vertex, double weight, Eigen::Ref<Eigen::Matrix3Xd> jacobian) const;

  // The state after a step.
  BodyState stepped(const BodyState& state, const Eigen::VectorXd& step) const;

 private:
  // Shapes, head shapes and expressions are morphs alike.
  int morph_count() const { return shape_count_ + head_count_ + static_cast<int>(expressions_.size()); }

  const BodyTemplate& body_;
  std::vector<int> free_joints_;
  int shape_count_, head_count_;
  std::vector<int> expressions_;
  std::vector<int> slot_;                        // per joint: its place among the free ones, -1: held
  std::vector<Eigen::Matrix3Xf> vertex_shapes_;  // per vertex: 3 x morphs
  std::vector<Eigen::Matrix3Xd> joint_shapes_;   // per joint: 3 x morphs
  const BodyState* state_ = nullptr;
  const PosedBody* posed_ = nullptr;
  std::vector<Eigen::Matrix3d> parent_rotation_;  // per joint
  std::vector<Eigen::Vector3d> joint_places_;     // posed
  std::vector<Eigen::Matrix3Xd> skin_shapes_;     // per joint: dp_j - s G_j B_j
};

}  // namespace gyre
