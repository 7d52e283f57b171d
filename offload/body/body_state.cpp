// SPDX-License-Identifier: Apache-2.0
#include "offload/body/body_state.h"

#include <cmath>

namespace gyre {

PosedBody evaluate(const BodyTemplate& body, const BodyState& state) {
  PosedBody posed;
  posed.rest_vertices = shaped_vertices(body, state.shape, state.head);
  posed.rest_joints = joint_positions(body, posed.rest_vertices);
  for (Eigen::Vector3d& joint : posed.rest_joints) joint *= state.scale;
  add_morphs(posed.rest_vertices, body.expressions, state.expression);
  for (Eigen::Vector3d& v : posed.rest_vertices) v *= state.scale;
  posed.posed_from_rest = joint_transforms(body, posed.rest_joints, state.pose);
  posed.vertices = skin_vertices(body, posed.rest_vertices, posed.posed_from_rest);
  posed.normals = vertex_normals(posed.vertices, body.mesh.triangles);
  return posed;
}

BodyState rest_state(const BodyTemplate& body) {
  BodyState state;
  state.shape = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(body.shapes.size()));
  state.pose.rotations.assign(body.joints.size(), Eigen::Vector3d::Zero());
  return state;
}

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

Eigen::Matrix3d rotation_of(const Eigen::Vector3d& rotation_vector) {
  const double angle = rotation_vector.norm();
  if (angle < 1e-12) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, rotation_vector / angle).toRotationMatrix();
}

Eigen::Vector3d rotation_vector_of(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd turn(rotation);
  return turn.angle() * turn.axis();
}

double yaw_of(const BodyPose& pose) {
  const Eigen::Vector3d forward = rotation_of(pose.rotations[0]) * Eigen::Vector3d::UnitZ();
  return std::atan2(forward.x(), forward.z());
}

}  // namespace gyre
