// SPDX-License-Identifier: Apache-2.0
// A body taken from its rest pose to the T-pose that exchange formats ask for.
#pragma once

#include "offload/body/template.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

namespace gyre {

// The pose that takes the given rest joints to the T of VRM 1.0: upper arms, forearms, the line from wrist to middle
// knuckle and the fingers along x, palms down, thumbs forward at 45 degrees, thighs and shanks straight down, feet as
// they were with their toes. Bones that the template lacks stay.
BodyPose t_pose(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& rest_joints);

struct ReposedSurface {
  std::vector<Eigen::Vector3d> vertices;  // soles on y = 0
  std::vector<Eigen::Vector3d> joints;
  std::vector<Eigen::Affine3d> reposed_from_rest;  // per joint
};

// Skins the rest surface by `pose` and puts the soles on the floor: a new rest surface, in that pose. unskin_vertices
// with reposed_from_rest takes it back.
ReposedSurface repose(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& rest_vertices,
                      const std::vector<Eigen::Vector3d>& rest_joints, const BodyPose& pose);

}  // namespace gyre
