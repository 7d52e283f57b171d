// SPDX-License-Identifier: Apache-2.0
#include "offload/body/joint_range.h"

#include <Eigen/Geometry>

namespace gyre {
namespace {

// Radians from a straight limb: along, forwards, sideways.
struct Bounds {
  std::string_view bone;  // without its side
  Eigen::Vector3d least, most;
  bool from_straight = false;  // the bend counts from the parent's direction, not from the rest pose
};

// Rounded from the normal ranges of motion of the American Academy of Orthopaedic Surgeons (1965), a little wider.
const std::vector<Bounds>& bounds() {
  static const std::vector<Bounds> list = {{"spine", {-0.4, -0.4, -0.4}, {0.4, 0.7, 0.4}},
                                           {"chest", {-0.4, -0.4, -0.4}, {0.4, 0.7, 0.4}},
                                           {"upperChest", {-0.4, -0.4, -0.4}, {0.4, 0.7, 0.4}},
                                           {"neck", {-0.7, -0.7, -0.5}, {0.7, 0.7, 0.5}},
                                           {"head", {-0.8, -0.6, -0.5}, {0.8, 0.6, 0.5}},
                                           {"jaw", {-0.2, -0.6, -0.6}, {0.2, 0.6, 0.6}},
                                           {"Eye", {-0.8, -0.8, -0.8}, {0.8, 0.8, 0.8}},
                                           {"UpperLeg", {-0.9, -0.7, -0.9}, {0.9, 2.2, 0.9}},
                                           {"LowerLeg", {-0.5, -2.6, -0.15}, {0.5, 0.15, 0.15}, true},
                                           {"Foot", {-0.5, -1.0, -0.6}, {0.5, 0.7, 0.6}},
                                           {"Toes", {-0.2, -0.8, -0.3}, {0.2, 1.0, 0.3}},
                                           {"Shoulder", {-0.4, -0.6, -0.7}, {0.4, 0.6, 0.7}},
                                           {"UpperArm", {-1.7, -1.3, -2.2}, {1.7, 2.8, 2.2}},
                                           {"LowerArm", {-1.7, -0.15, -0.15}, {1.7, 2.7, 0.15}, true},
                                           {"Hand", {-0.4, -1.4, -0.7}, {0.4, 1.4, 0.7}},
                                           {"ThumbMetacarpal", {-0.8, -0.9, -0.9}, {0.8, 0.9, 0.9}},
                                           {"ThumbProximal", {-0.3, -0.9, -0.9}, {0.3, 1.2, 0.9}},
                                           {"ThumbDistal", {-0.2, -1.0, -1.0}, {0.2, 1.6, 1.0}},
                                           {"Proximal", {-0.3, -0.8, -0.5}, {0.3, 1.8, 0.5}},
                                           {"Intermediate", {-0.15, -0.4, -0.25}, {0.15, 2.1, 0.25}},
                                           {"Distal", {-0.15, -0.5, -0.25}, {0.15, 1.8, 0.25}}};
  return list;
}

const Bounds* bounds_of(std::string_view bone) {
  if (bone.starts_with("left")) bone.remove_prefix(4);
  if (bone.starts_with("right")) bone.remove_prefix(5);
  for (const Bounds& b : bounds())
    if (b.bone == bone) return &b;
  for (const char* finger : {"Index", "Middle", "Ring", "Little"})
    if (bone.starts_with(finger)) return bounds_of(bone.substr(std::string_view(finger).size()));
  return nullptr;
}

}  // namespace

void set_joint_ranges(BodyTemplate& body) {
  const std::vector<Eigen::Vector3d> at = joint_positions(body, body.mesh.vertices);
  std::vector<Eigen::Vector3d> along(at.size(), Eigen::Vector3d::UnitY());
  for (std::size_t j = 0; j < at.size(); ++j) {
    const int parent = body.joints[j].parent;
    int child = -1;
    for (std::size_t c = 0; c < at.size() && child < 0; ++c)
      if (body.joints[c].parent == static_cast<int>(j) && (at[c] - at[j]).norm() > 1e-6) child = static_cast<int>(c);
    if (child >= 0) {
      along[j] = (at[child] - at[j]).normalized();
    } else if (parent >= 0) {
      along[j] = along[parent];
    }
  }
  for (std::size_t j = 0; j < at.size(); ++j) {
    Joint& joint = body.joints[j];
    const Bounds* found = bounds_of(joint.name);
    if (!found || joint.parent < 0) continue;
    const bool left = joint.name.starts_with("left");
    const std::string side = left ? "left" : "right";
    // Where it bends to: forwards, or up for feet, or into the palm, which lies across hand and knuckles.
    Eigen::Vector3d towards = Eigen::Vector3d::UnitZ();
    const int index = body.joint_index(side + "IndexProximal"), little = body.joint_index(side + "LittleProximal");
    const bool in_hand = joint.name.find("Hand") != std::string::npos || joint.name.ends_with("Proximal") ||
                         joint.name.ends_with("Intermediate") || joint.name.ends_with("Distal");
    if (in_hand && index >= 0 && little >= 0) {
      const Eigen::Vector3d palm = (at[little] - at[index]).cross(along[j]);
      towards = left ? palm : Eigen::Vector3d(-palm);
    }
    if (std::abs(along[j].dot(towards.normalized())) > 0.8) towards = Eigen::Vector3d::UnitY();
    JointRange& range = joint.range;
    range.axes.col(0) = along[j];
    range.axes.col(1) = along[j].cross(towards).normalized();
    range.axes.col(2) = range.axes.col(0).cross(range.axes.col(1));
    range.least = found->least;
    range.most = found->most;
    if (found->from_straight) {
      const double bent =
          std::atan2(range.axes.col(1).dot(along[joint.parent].cross(along[j])), along[joint.parent].dot(along[j]));
      range.least[1] -= bent;
      range.most[1] -= bent;
    }
  }
}

Eigen::Vector3d beyond(const JointRange& range, const Eigen::Vector3d& rotation) {
  const Eigen::Vector3d along = range.axes.transpose() * rotation;
  return along - along.cwiseMax(range.least).cwiseMin(range.most);
}

Eigen::Vector3d within(const JointRange& range, const Eigen::Vector3d& rotation) {
  return rotation - range.axes * beyond(range, rotation);
}

}  // namespace gyre
