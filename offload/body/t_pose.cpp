// SPDX-License-Identifier: Apache-2.0
#include "offload/body/t_pose.h"

#include <array>
#include <limits>

namespace gyre {

namespace {

using Vector = Eigen::Vector3d;

Vector rotation_vector(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd turn(rotation);
  return turn.angle() * turn.axis();
}

// Builds up world rotations bone by bone; a bone's own rotation is what its parent's does not give it.
class Poser {
 public:
  Poser(const BodyTemplate& body, const std::vector<Vector>& joints)
      : body_(body),
        joints_(joints),
        turns_(joints.size(), Eigen::Matrix3d::Identity()),
        fixed_(joints.size(), false) {}

  int joint(const std::string& name) const { return body_.joint_index(name); }

  // From one joint to another, at rest.
  Vector bone(int from, int to) const { return (joints_[to] - joints_[from]).normalized(); }

  void turn(int bone, const Eigen::Matrix3d& world_from_rest) {
    turns_[bone] = world_from_rest;
    fixed_[bone] = true;
  }
  const Eigen::Matrix3d& turn_of(int bone) const { return turns_[bone]; }

  BodyPose pose() {
    BodyPose pose;
    pose.rotations.resize(joints_.size());
    for (std::size_t j = 0; j < joints_.size(); ++j) {
      const int parent = body_.joints[j].parent;
      const Eigen::Matrix3d inherited = parent < 0 ? Eigen::Matrix3d(Eigen::Matrix3d::Identity()) : turns_[parent];
      if (!fixed_[j]) turns_[j] = inherited;
      pose.rotations[j] = rotation_vector(inherited.transpose() * turns_[j]);
    }
    return pose;
  }

 private:
  const BodyTemplate& body_;
  const std::vector<Vector>& joints_;
  std::vector<Eigen::Matrix3d> turns_;  // world_from_rest
  std::vector<bool> fixed_;
};

// The least turn that takes one direction to another.
Eigen::Matrix3d least_turn(const Vector& from, const Vector& to) {
  return Eigen::Quaterniond::FromTwoVectors(from, to).toRotationMatrix();
}

// Each segment of a finger along a direction; the last one, whose end no joint marks, as the one before it.
void straighten_finger(Poser& poser, const std::array<std::string, 3>& joints, const Eigen::Matrix3d& hand_turn,
                       const Vector& along) {
  std::array<int, 3> chain{};
  for (std::size_t k = 0; k < 3; ++k)
    if (chain[k] = poser.joint(joints[k]); chain[k] < 0) return;
  for (std::size_t k = 0; k < 2; ++k)
    poser.turn(chain[k], least_turn(hand_turn * poser.bone(chain[k], chain[k + 1]), along) * hand_turn);
  poser.turn(chain[2], poser.turn_of(chain[1]));
}

void straighten_arm(Poser& poser, const std::string& side) {
  const Vector along = side == "left" ? Vector(Vector::UnitX()) : Vector(-Vector::UnitX());
  const int upper = poser.joint(side + "UpperArm"), lower = poser.joint(side + "LowerArm");
  const int hand = poser.joint(side + "Hand"), middle = poser.joint(side + "MiddleProximal");
  const int index = poser.joint(side + "IndexProximal"), little = poser.joint(side + "LittleProximal");
  if (upper < 0 || lower < 0 || hand < 0) return;
  if (middle < 0 || index < 0 || little < 0) {
    poser.turn(upper, least_turn(poser.bone(upper, lower), along));
    poser.turn(lower, least_turn(poser.bone(lower, hand), along));
    return;
  }
  // The hand: fingers along the arm, palm down. The palm looks along the cross product of its two edges.
  const Vector fingers = poser.bone(hand, middle);
  Vector palm = poser.bone(hand, little).cross(poser.bone(hand, index));
  if (side == "right") palm = -palm;
  palm = (palm - fingers * fingers.dot(palm)).normalized();
  Eigen::Matrix3d at_rest, wanted;
  at_rest << fingers, palm, fingers.cross(palm);
  wanted << along, -Vector::UnitY(), along.cross(Vector(-Vector::UnitY()));
  const Eigen::Matrix3d hand_turn = wanted * at_rest.transpose();
  // The twist that turns the palm down is shared: a forearm turns about itself over its whole length, the upper arm in
  // the shoulder.
  const Eigen::Matrix3d upper_swing = least_turn(poser.bone(upper, lower), along);
  const Eigen::Matrix3d lower_swing = least_turn(poser.bone(lower, hand), along);
  const Eigen::Matrix3d left_over = hand_turn * least_turn(fingers, along).transpose();
  const Eigen::AngleAxisd twist(left_over);
  const double angle = twist.angle() * (twist.axis().dot(along) < 0 ? -1.0 : 1.0);
  poser.turn(upper, Eigen::AngleAxisd(angle / 3.0, along) * upper_swing);
  poser.turn(lower, Eigen::AngleAxisd(angle * 2.0 / 3.0, along) * lower_swing);
  poser.turn(hand, hand_turn);
  for (const std::string finger : {"Index", "Middle", "Ring", "Little"})
    straighten_finger(poser, {side + finger + "Proximal", side + finger + "Intermediate", side + finger + "Distal"},
                      hand_turn, along);
  straighten_finger(poser, {side + "ThumbMetacarpal", side + "ThumbProximal", side + "ThumbDistal"}, hand_turn,
                    (along + Vector::UnitZ()).normalized());
}

void straighten_leg(Poser& poser, const std::string& side) {
  const int upper = poser.joint(side + "UpperLeg"), lower = poser.joint(side + "LowerLeg");
  const int foot = poser.joint(side + "Foot");
  if (upper < 0 || lower < 0 || foot < 0) return;
  poser.turn(upper, least_turn(poser.bone(upper, lower), -Vector::UnitY()));
  poser.turn(lower, least_turn(poser.bone(lower, foot), -Vector::UnitY()));
  poser.turn(foot, Eigen::Matrix3d::Identity());
}

}  // namespace

BodyPose t_pose(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& rest_joints) {
  Poser poser(body, rest_joints);
  for (const char* side : {"left", "right"}) {
    straighten_arm(poser, side);
    straighten_leg(poser, side);
  }
  return poser.pose();
}

ReposedSurface repose(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& rest_vertices,
                      const std::vector<Eigen::Vector3d>& rest_joints, const BodyPose& pose) {
  ReposedSurface reposed;
  reposed.reposed_from_rest = joint_transforms(body, rest_joints, pose);
  const std::vector<Eigen::Vector3d> skinned = skin_vertices(body, rest_vertices, reposed.reposed_from_rest);
  const TemplatePart* part = body.part("body");
  const std::size_t count = part ? part->vertex_count : skinned.size();
  double sole = std::numeric_limits<double>::infinity();
  for (std::size_t v = 0; v < count; ++v) sole = std::min(sole, skinned[v].y());
  for (Eigen::Affine3d& transform : reposed.reposed_from_rest) transform.pretranslate(Eigen::Vector3d(0, -sole, 0));
  for (std::size_t v = 0; v < skinned.size(); ++v)
    reposed.vertices.emplace_back(skinned[v].x(), skinned[v].y() - sole, skinned[v].z());
  for (std::size_t j = 0; j < rest_joints.size(); ++j)
    reposed.joints.push_back(reposed.reposed_from_rest[j] * rest_joints[j]);
  return reposed;
}

}  // namespace gyre
