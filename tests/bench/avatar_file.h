// SPDX-License-Identifier: Apache-2.0
// An avatar's GLB as a player has it: posed, with expressions.
#pragma once

#include "common/mesh/mesh.h"
#include "common/result/result.h"
#include "offload/avatar/avatar.h"

#include <Eigen/Geometry>
#include <filesystem>
#include <map>
#include <opencv2/core/mat.hpp>
#include <string>

namespace gyre {

struct AvatarFile {
  Avatar avatar;    // joints, skin, shapes and surface; no texture, no normals
  cv::Mat picture;  // the texture, BGR
};

// Reads what write_glb writes.
Result<AvatarFile> read_avatar_file(const std::filesystem::path& file);

// The surface with expressions at their weights and joints turned about world axes (radians times axis), with the
// texture coordinates of the file.
TriangleMesh posed_mesh(const Avatar& avatar, const std::map<std::string, double>& expressions,
                        const std::map<std::string, Eigen::Vector3d>& turns);

}  // namespace gyre
