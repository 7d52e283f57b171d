// SPDX-License-Identifier: Apache-2.0
// The synthetic person: a smooth union of tapered capsules in A-pose, with its skeleton.
#pragma once

#include "common/mesh/mesh.h"

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

namespace gyre::synthetic {

// What a piece of the surface is made of.
enum class Material : std::uint8_t { skin, face, hair, sweater, trousers, shoe, floor, ceiling, wall, box, mirror };

struct NamedJoint {
  std::string name;    // as in the Mixamo skeleton: "Hips", "LeftArm", ...
  std::string parent;  // empty: root
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
};

struct Subject {
  TriangleMesh mesh;  // closed, with normals and colours; facing +Z, its left at +X, soles on y = 0, metres
  std::vector<Material> materials;  // one a triangle
  std::vector<NamedJoint> joints;   // parents first
  double stature = 0.0;             // soles to the top of the hair, metres
};

struct SubjectOptions {
  double stature = 1.70;  // metres
  double cell = 0.012;    // size of the mesh's cells, metres, at stature 1.70
  double folds = 0.004;   // height of the folds of the clothes, metres
  std::uint64_t seed = 1;
};

Subject make_subject(const SubjectOptions& options = {});

}  // namespace gyre::synthetic
