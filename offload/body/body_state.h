// SPDX-License-Identifier: Apache-2.0
// The parameters of a fitted body and the surface they give.
#pragma once

#include "offload/body/template.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

namespace gyre {

// The rest surface is scale times the shaped template with its expression; the pose moves that. Joints belong to the
// neutral face.
struct BodyState {
  double scale = 1.0;
  Eigen::VectorXd shape;       // standard deviations
  BodyPose pose;               // world; the root's rotation holds the facing
  Eigen::VectorXd head;        // of head_shapes, standard deviations; may be shorter
  Eigen::VectorXd expression;  // weight of each of the template's expressions; may be shorter
};

struct PosedBody {
  std::vector<Eigen::Vector3d> rest_vertices;  // with the expression
  std::vector<Eigen::Vector3d> rest_joints;
  std::vector<Eigen::Affine3d> posed_from_rest;  // per joint
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector3d> normals;  // of the posed surface

  Eigen::Vector3d joint(int index) const { return posed_from_rest[index] * rest_joints[index]; }
};

// The whole template in the given state.
PosedBody evaluate(const BodyTemplate& body, const BodyState& state);

// The identity: mean shape, rest pose.
BodyState rest_state(const BodyTemplate& body);

// The matrix whose product with w is v x w.
Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v);

// Rotation by |vector| radians about it, and back (angle at most pi).
Eigen::Matrix3d rotation_of(const Eigen::Vector3d& rotation_vector);
Eigen::Vector3d rotation_vector_of(const Eigen::Matrix3d& rotation);

// Heading of the root: radians counter-clockwise from above, 0 = facing +Z.
double yaw_of(const BodyPose& pose);

}  // namespace gyre
