// SPDX-License-Identifier: Apache-2.0
// The template sources as files: MakeHuman's base mesh, its targets, rig, weights and fitted parts.
#pragma once

#include "common/mesh/mesh.h"
#include "common/result/result.h"

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace gyre {

// Offsets of base vertices, metres.
struct Target {
  std::vector<int> vertices;
  std::vector<Eigen::Vector3f> offsets;
};

using TargetSet = std::map<std::string, Target>;

// Vertex ranges of the hm08 base mesh, [first, last).
struct BaseRanges {
  static constexpr int count = 19158;
  static constexpr int body = 13380;        // 0 to here
  static constexpr int tongue_end = 13606;  // from `body` to here
  static constexpr int left_eye = 14598, right_eye = 14670, eyes_end = 14742;
  static constexpr int left_lashes = 14742, right_lashes = 14867, lashes_end = 14992;
  static constexpr int lower_teeth = 14992, upper_teeth = 15060, teeth_end = 15128;
};

// A point that follows the base mesh: sum of weight * base vertex, plus an offset.
struct BoundPoint {
  std::array<int, 3> base{};
  std::array<double, 3> weight{};
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  // metres
};

// A mesh fitted to the base mesh (.mhclo with its .obj): topology, texture coordinates and one binding a vertex.
struct BoundMesh {
  TriangleMesh mesh;
  std::vector<BoundPoint> binding;
};

struct SourceBone {
  std::string parent;
  std::vector<int> head;  // base vertices whose mean is the joint
};

struct Sources {
  TriangleMesh base;  // metres, Y up, facing +Z; quads as two triangles each
  std::map<std::string, SourceBone> bones;
  std::map<std::string, std::vector<std::pair<int, double>>> weights;  // bone -> (base vertex, weight)
  std::vector<int> mirror;                                             // base vertex -> base vertex
  TargetSet targets;      // by name without folders: macro, breast and measure targets
  TargetSet expressions;  // by ARKit or viseme name
  BoundMesh eyes, teeth;
  std::string notices;
};

// Reads everything build_template() needs; an error names the file and what is wrong in it.
Result<Sources> read_sources(const std::filesystem::path& folder);

}  // namespace gyre
