// SPDX-License-Identifier: Apache-2.0
#include "offload/fit/rest_surface.h"

#include <algorithm>
#include <limits>

namespace gyre {

RestSurface unpose(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& posed,
                   const std::vector<Eigen::Vector3d>& first_joints, const BodyPose& pose, int rounds) {
  RestSurface rest;
  rest.pose = pose;
  rest.joints = first_joints;
  const auto unskin = [&] {
    rest.posed_from_rest = joint_transforms(body, rest.joints, rest.pose);
    rest.vertices = unskin_vertices(body, posed, rest.posed_from_rest);
  };
  unskin();
  const TemplatePart* part = body.part("body");
  const std::size_t count = part ? part->vertex_count : rest.vertices.size();
  for (int round = 0; round < rounds; ++round) {
    double sole = std::numeric_limits<double>::infinity();
    for (std::size_t v = 0; v < count; ++v) sole = std::min(sole, rest.vertices[v].y());
    rest.joints = joint_positions(body, rest.vertices);
    // The root's new joint is posed as a point of the old root bone, else the bone would swing about it. Then the whole
    // rest space is shifted to put the soles on the ground, which the translation takes back.
    rest.pose.translation = rest.posed_from_rest[0] * rest.joints[0] - rest.joints[0];
    for (Eigen::Vector3d& joint : rest.joints) joint.y() -= sole;
    rest.pose.translation.y() += sole;
    unskin();
  }
  return rest;
}

}  // namespace gyre
