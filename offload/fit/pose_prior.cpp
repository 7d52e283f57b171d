// SPDX-License-Identifier: Apache-2.0
#include "offload/fit/pose_prior.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <string>

namespace gyre {

namespace {

struct MainJoint {
  std::string_view name;
  double bend, twist;  // standard deviations, radians: about the axes across the bone, about the bone
  bool limb;           // exists on both sides
};

// The heading and small tilts of the root are free; the trunk's turns add up over several joints.
constexpr std::array<MainJoint, 12> main_joints{{{"spine", 0.12, 0.08, false},
                                                 {"chest", 0.12, 0.08, false},
                                                 {"upperChest", 0.12, 0.08, false},
                                                 {"neck", 0.1, 0.06, false},
                                                 {"head", 0.1, 0.1, false},
                                                 {"Shoulder", 0.12, 0.05, true},
                                                 {"UpperArm", 0.5, 0.3, true},
                                                 {"LowerArm", 0.4, 0.3, true},
                                                 {"Hand", 0.2, 0.2, true},
                                                 {"UpperLeg", 0.3, 0.15, true},
                                                 {"LowerLeg", 0.2, 0.08, true},
                                                 {"Foot", 0.2, 0.15, true}}};

// Rest direction of a joint's bone: to its first child.
Eigen::Vector3d bone_direction(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& joints, int joint) {
  for (std::size_t child = 0; child < body.joints.size(); ++child)
    if (body.joints[child].parent == joint && (joints[child] - joints[joint]).norm() > 1e-6)
      return (joints[child] - joints[joint]).normalized();
  return Eigen::Vector3d::UnitY();
}

// Inverse of the left Jacobian of SO(3): how the rotation vector r moves when a small turn is applied from the left
// (Sola, Deray, Atchuthan, A micro Lie theory, 2018, eq. 146).
Eigen::Matrix3d inverse_left_jacobian(const Eigen::Vector3d& r) {
  Eigen::Matrix3d cross;
  cross << 0, -r.z(), r.y(), r.z(), 0, -r.x(), -r.y(), r.x(), 0;
  const double angle = r.norm();
  const double factor =
      angle < 1e-4 ? 1.0 / 12.0 : 1.0 / (angle * angle) - (1.0 + std::cos(angle)) / (2.0 * angle * std::sin(angle));
  return Eigen::Matrix3d::Identity() - 0.5 * cross + factor * cross * cross;
}

}  // namespace

PosePrior standing_prior(const BodyTemplate& body, const BodyPose& start) {
  PosePrior prior;
  const std::vector<Eigen::Vector3d> joints = joint_positions(body, body.mesh.vertices);
  std::vector<std::pair<int, const MainJoint*>> found;
  for (const MainJoint& main : main_joints) {
    for (const std::string side : {"left", "right"}) {
      const int joint = body.joint_index(main.limb ? side + std::string(main.name) : std::string(main.name));
      if (joint > 0) found.emplace_back(joint, &main);
      if (!main.limb) break;
    }
  }
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first < b.first; });

  prior.joints.push_back(0);
  prior.means.push_back(start.rotations[0]);
  prior.spreads.emplace_back(0.1, 3.0, 0.1);
  for (const auto& [joint, main] : found) {
    const Eigen::Vector3d bone = bone_direction(body, joints, joint).cwiseAbs2();
    prior.joints.push_back(joint);
    prior.means.push_back(start.rotations[joint]);
    prior.spreads.emplace_back(bone * main->twist + (Eigen::Vector3d::Ones() - bone) * main->bend);
  }
  for (const bool left : {true, false}) {
    const std::string side = left ? "left" : "right";
    if (const int knee = body.joint_index(side + "LowerLeg"); knee >= 0)
      prior.limits.push_back({knee, Eigen::Vector3d::UnitX(), -0.05, 2.0});
    if (const int elbow = body.joint_index(side + "LowerArm"); elbow >= 0) {
      // The forearm comes forward by a turn about (arm direction x forward).
      const Eigen::Vector3d axis = bone_direction(body, joints, elbow).cross(Eigen::Vector3d::UnitZ()).normalized();
      prior.limits.push_back({elbow, axis, -0.1, 2.3});
    }
  }
  return prior;
}

void add_prior(const PosePrior& prior, const BodyPose& pose, int first_column, double limit_spread,
               Eigen::MatrixXd& hessian, Eigen::VectorXd& gradient) {
  std::vector<int> slot(pose.rotations.size(), -1);
  for (std::size_t k = 0; k < prior.joints.size(); ++k) {
    const int column = first_column + 3 * static_cast<int>(k);
    const Eigen::Vector3d& r = pose.rotations[prior.joints[k]];
    slot[prior.joints[k]] = column;
    const Eigen::Matrix3d inverse_spread = prior.spreads[k].cwiseInverse().asDiagonal();
    const Eigen::Matrix3d jacobian = inverse_spread * inverse_left_jacobian(r);
    hessian.block<3, 3>(column, column) += jacobian.transpose() * jacobian;
    gradient.segment<3>(column) += jacobian.transpose() * (inverse_spread * (r - prior.means[k]));
  }
  for (const JointLimit& limit : prior.limits) {
    const int column = slot[limit.joint];
    if (column < 0) continue;
    const Eigen::Vector3d& r = pose.rotations[limit.joint];
    const double angle = limit.axis.dot(r);
    const double beyond = angle - std::clamp(angle, limit.least, limit.most);
    if (beyond == 0.0) continue;
    const Eigen::RowVector3d jacobian = limit.axis.transpose() * inverse_left_jacobian(r) / limit_spread;
    hessian.block<3, 3>(column, column) += jacobian.transpose() * jacobian;
    gradient.segment<3>(column) += jacobian.transpose() * (beyond / limit_spread);
  }
}

}  // namespace gyre
