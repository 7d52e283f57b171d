// SPDX-License-Identifier: Apache-2.0
// The room around the synthetic person: floor, ceiling, four walls, some boxes.
#pragma once

#include "common/mesh/mesh.h"
#include "tests/synthetic/appearance.h"
#include "tests/synthetic/subject.h"
#include "tests/synthetic/trouble.h"

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <vector>

namespace gyre::synthetic {

struct Room {
  TriangleMesh mesh;                // with normals; triangles small against the curvature of a lens, seen from inside
  std::vector<Material> materials;  // one a triangle
  // The plane of the triangles that are a mirror, its normal into the room; everything lies in front of it.
  std::optional<Eigen::Hyperplane<double, 3>> mirror;
};

Room make_room(std::uint64_t seed, const RoomSize& size = {}, const Trouble& trouble = {});

}  // namespace gyre::synthetic
