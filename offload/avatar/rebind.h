// SPDX-License-Identifier: Apache-2.0
// An avatar bound in another pose than the one it was fitted in.
#pragma once

#include "offload/avatar/avatar.h"

#include <Eigen/Geometry>

namespace gyre {

// Linear blend skinning makes the pose the new rest pose: positions, normals and the displacements of expressions turn
// with the skin, joints go along, and their axes are the world's again. posed_from_rest: one a joint, rigid.
Avatar rebound(const Avatar& avatar, const std::vector<Eigen::Affine3d>& posed_from_rest);

}  // namespace gyre
