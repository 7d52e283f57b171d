// SPDX-License-Identifier: Apache-2.0
// The fitted surface taken back to the template's rest pose, with joints that belong to it.
#pragma once

#include "offload/body/template.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

namespace gyre {

struct RestSurface {
  std::vector<Eigen::Vector3d> vertices;  // soles on y = 0
  std::vector<Eigen::Vector3d> joints;    // regressed from the vertices
  BodyPose pose;                          // with the translation that belongs to these joints
  std::vector<Eigen::Affine3d> posed_from_rest;
};

// Unskins `posed` (whole template) by `pose`. The joints depend on the rest surface and that on the joints, so a few
// rounds from `first_joints`, the rest joints of the pose, bring both together; skinning `vertices` by
// `posed_from_rest` gives `posed` again.
RestSurface unpose(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& posed,
                   const std::vector<Eigen::Vector3d>& first_joints, const BodyPose& pose, int rounds = 5);

}  // namespace gyre
