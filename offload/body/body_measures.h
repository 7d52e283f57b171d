// SPDX-License-Identifier: Apache-2.0
// Tape measures of a body mesh, as anthropometric surveys define them.
#pragma once

#include "common/mesh/mesh.h"

#include <Eigen/Core>
#include <span>
#include <vector>

namespace gyre {

// Length of the convex hull (a tape does not follow hollows) around the cut of the triangles with the plane y = level,
// metres; 0 when nothing is cut.
double girth(const std::vector<Eigen::Vector3d>& vertices, std::span<const Eigen::Vector3i> triangles, double level);

// Difference of the largest and smallest y of the first `count` vertices, metres.
double stature(const std::vector<Eigen::Vector3d>& vertices, std::size_t count);

// A tape that stays on the same points of the surface whatever the shape: where it crosses edges of the mesh.
struct Tape {
  struct Crossing {
    int a, b;     // vertices
    double at_b;  // weight of b, in [0, 1]
  };
  std::vector<Crossing> crossings;
  Eigen::Vector3d normal = Eigen::Vector3d::UnitY();  // of its plane
};

// The tape in the plane through `point` across `normal` (unit).
Tape tape_through(const std::vector<Eigen::Vector3d>& vertices, std::span<const Eigen::Vector3i> triangles,
                  const Eigen::Vector3d& point, const Eigen::Vector3d& normal);

// Length of the convex hull of the tape, seen along its normal; metres. vertices: 3 x n.
double girth(const Eigen::Matrix3Xd& vertices, const Tape& tape);

// Distance between the tape's outermost points along a coordinate axis (0: x, 1: y, 2: z), metres.
double extent(const Eigen::Matrix3Xd& vertices, const Tape& tape, int axis);

}  // namespace gyre
