// SPDX-License-Identifier: Apache-2.0
// Small steps that every maker of a template needs.
#pragma once

#include "offload/body/template.h"

#include <string>
#include <string_view>
#include <vector>

namespace gyre {

// The four largest of one weight a joint (at least one positive), scaled to sum to 1.
SkinWeights strongest_joints(const Eigen::VectorXd& weight_of_joint);

// Rows (vertices x 3, metres) longer than `least` as a morph.
Morph sparse_morph(std::string name, const Eigen::MatrixXd& offsets, double least);

// Where a humanoid bone's skin is, by its name; torso for names that are not known.
BodyRegion region_of_bone(std::string_view bone);

// left_x and right_x swapped, others unchanged.
BodyRegion mirrored_region(BodyRegion region);

// For each vertex the nearest one to its image at -x within `tolerance` (metres), -1: none.
std::vector<int> mirror_by_position(const std::vector<Eigen::Vector3d>& vertices, double tolerance);

}  // namespace gyre
