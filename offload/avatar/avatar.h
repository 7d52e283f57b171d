// SPDX-License-Identifier: Apache-2.0
// The fitted person as a rigged, textured mesh ready to be written in any exchange format.
#pragma once

#include "common/result/result.h"
#include "offload/body/template.h"

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace gyre {

// A joint in the rest pose; parents come first.
struct AvatarJoint {
  std::string name;
  int parent = -1;
  Eigen::Vector3d position;  // metres, world; the joint's axes are the world's
};

// Displacements at full strength, one a vertex.
struct AvatarMorph {
  std::string name;
  std::vector<Eigen::Vector3f> positions;
  std::vector<Eigen::Vector3f> normals;
};

// One mesh with one texture. A vertex has one texture coordinate: the surface is split at texture seams.
struct Avatar {
  std::vector<Eigen::Vector3f> positions;  // metres, rest pose, +Y up, facing +Z
  std::vector<Eigen::Vector3f> normals;    // unit
  std::vector<Eigen::Vector2f> uv;         // origin top left
  std::vector<Eigen::Vector4f> tangents;   // as glTF's; only with a normal map
  std::vector<SkinWeights> skin;
  std::vector<Eigen::Vector3i> triangles;
  std::vector<AvatarJoint> joints;
  std::vector<AvatarMorph> morphs;
  std::vector<std::byte> texture;     // a PNG or JPEG file
  std::string texture_type;           // "image/png" or "image/jpeg"
  std::vector<std::byte> normal_map;  // a PNG file, up in the picture is positive; empty: none
  nlohmann::ordered_json facts;       // written beside the asset's version
};

// Gives the avatar a normal map and the tangents it is written in.
void add_normal_map(Avatar& avatar, std::vector<std::byte> png);

// Splits the template's surface at its texture seams and gives it the fitted rest shape. Expressions are
// transferred to the person (ExpressionTransfer). rest_vertices: all template vertices in the template's rest pose,
// metres; rest_joints: one a joint. Error when the numbers do not fit the template.
Result<Avatar> assemble_avatar(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& rest_vertices,
                               const std::vector<Eigen::Vector3d>& rest_joints);

// At most four influences, each joint once, heaviest first, weights above 1e-4 that sum to 1, joint 0 where the weight
// is 0: what every importer reads alike.
SkinWeights tidy_weights(const SkinWeights& weights);

}  // namespace gyre
