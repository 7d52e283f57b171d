// SPDX-License-Identifier: Apache-2.0
// Where the landmarks of synthetic A truly are.
#pragma once

#include "common/mesh/mesh.h"

#include <Eigen/Core>
#include <map>
#include <string>

namespace gyre {

// From `mesh_full.ply` of any pass of synthetic A (pose of frame 0): means of vertices that were picked on renderings
// of that mesh with its texture, by the definitions of the landmarks: the tip of the nose is the vertices farthest out,
// the chin those whose normal points half way between forward and down, corners of eyes and mouth are the ends of the
// openings in the skin, nostrils the middles of their rims.
std::map<std::string, Eigen::Vector3d> true_landmarks_of_synthetic_a(const TriangleMesh& mesh);

// One of those the face is judged by: nose tip, chin, corners of eyes and mouth, nostrils.
bool is_face_landmark(const std::string& name);

}  // namespace gyre
