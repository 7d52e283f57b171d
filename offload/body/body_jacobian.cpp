// SPDX-License-Identifier: Apache-2.0
#include "offload/body/body_jacobian.h"

#include <cmath>

namespace gyre {

BodyJacobian::BodyJacobian(const BodyTemplate& body, std::vector<int> free_joints, int shape_count, int head_count,
                           std::vector<int> expressions)
    : body_(body),
      free_joints_(std::move(free_joints)),
      shape_count_(shape_count),
      head_count_(head_count),
      expressions_(std::move(expressions)),
      slot_(body.joints.size(), -1) {
  for (std::size_t i = 0; i < free_joints_.size(); ++i) slot_[free_joints_[i]] = static_cast<int>(i);
  std::vector<const Morph*> morphs;
  for (int s = 0; s < shape_count_; ++s) morphs.push_back(&body.shapes[s]);
  for (int s = 0; s < head_count_; ++s) morphs.push_back(&body.head_shapes[s]);
  for (int e : expressions_) morphs.push_back(&body.expressions[e]);
  vertex_shapes_.assign(body.mesh.vertices.size(), Eigen::Matrix3Xf::Zero(3, morph_count()));
  for (std::size_t m = 0; m < morphs.size(); ++m)
    for (std::size_t i = 0; i < morphs[m]->vertices.size(); ++i)
      vertex_shapes_[morphs[m]->vertices[i]].col(static_cast<Eigen::Index>(m)) = morphs[m]->offsets[i];
  for (const Joint& joint : body.joints) {
    Eigen::Matrix3Xd sum = Eigen::Matrix3Xd::Zero(3, morph_count());
    for (const auto& [vertex, weight] : joint.regressor) sum += weight * vertex_shapes_[vertex].cast<double>();
    sum.rightCols(static_cast<Eigen::Index>(expressions_.size())).setZero();
    joint_shapes_.push_back(std::move(sum));
  }
}

void BodyJacobian::linearise(const BodyState& state, const PosedBody& posed) {
  state_ = &state;
  posed_ = &posed;
  const std::size_t count = body_.joints.size();
  parent_rotation_.assign(count, Eigen::Matrix3d::Identity());
  joint_places_.resize(count);
  skin_shapes_.resize(count);
  std::vector<Eigen::Matrix3Xd> place_shapes(count);
  for (std::size_t j = 0; j < count; ++j) {
    const int parent = body_.joints[j].parent;
    joint_places_[j] = posed.joint(static_cast<int>(j));
    if (parent < 0) {
      place_shapes[j] = state.scale * joint_shapes_[j];
    } else {
      parent_rotation_[j] = posed.posed_from_rest[parent].linear();
      place_shapes[j] =
          place_shapes[parent] + state.scale * parent_rotation_[j] * (joint_shapes_[j] - joint_shapes_[parent]);
    }
    skin_shapes_[j] = place_shapes[j] - state.scale * posed.posed_from_rest[j].linear() * joint_shapes_[j];
  }
}

void BodyJacobian::add_vertex(int vertex, double weight, Eigen::Ref<Eigen::Matrix3Xd> jacobian) const {
  const SkinWeights& skin = body_.skin[vertex];
  const Eigen::Vector3d& rest = posed_->rest_vertices[vertex];
  jacobian.leftCols<3>() += weight * Eigen::Matrix3d::Identity();
  jacobian.col(3) += weight * (posed_->vertices[vertex] - state_->pose.translation);
  auto shapes = jacobian.rightCols(morph_count());
  Eigen::Matrix3d blended = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < skin.joint.size(); ++i) {
    const double w = weight * skin.weight[i];
    if (w == 0.0) continue;
    const int joint = skin.joint[i];
    const Eigen::Affine3d& transform = posed_->posed_from_rest[joint];
    const Eigen::Vector3d placed = transform * rest;
    for (int k = joint; k >= 0; k = body_.joints[k].parent)
      if (slot_[k] >= 0)
        jacobian.middleCols<3>(joint_column(slot_[k])) -=
            w * cross_matrix(placed - joint_places_[k]) * parent_rotation_[k];
    blended += w * transform.linear();
    shapes += w * skin_shapes_[joint];
  }
  shapes += state_->scale * blended * vertex_shapes_[vertex].cast<double>();
}

BodyState BodyJacobian::stepped(const BodyState& state, const Eigen::VectorXd& step) const {
  BodyState next = state;
  next.pose.translation += step.head<3>();
  next.scale *= std::exp(step[3]);
  for (std::size_t i = 0; i < free_joints_.size(); ++i) {
    Eigen::Vector3d& rotation = next.pose.rotations[free_joints_[i]];
    rotation =
        rotation_vector_of(rotation_of(step.segment<3>(joint_column(static_cast<int>(i)))) * rotation_of(rotation));
  }
  const auto add = [](Eigen::VectorXd& weights, Eigen::Index at, double more) {
    if (weights.size() <= at) weights.conservativeResizeLike(Eigen::VectorXd::Zero(at + 1));
    weights[at] += more;
  };
  for (int s = 0; s < shape_count_; ++s) add(next.shape, s, step[shape_column() + s]);
  for (int s = 0; s < head_count_; ++s) add(next.head, s, step[head_column() + s]);
  for (std::size_t e = 0; e < expressions_.size(); ++e)
    add(next.expression, expressions_[e], step[expression_column() + static_cast<int>(e)]);
  return next;
}

}  // namespace gyre
