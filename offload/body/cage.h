// SPDX-License-Identifier: Apache-2.0
// A coarse closed polygon mesh and its Catmull-Clark subdivision as a linear map, so that positions, skin weights and
// shape offsets are refined alike.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <vector>

namespace gyre {

struct CageFace {
  std::vector<int> corners;         // counter-clockwise seen from outside
  std::vector<Eigen::Vector2d> uv;  // one a corner
};

struct SubdividedCage {
  // Refined rows = weights * cage rows; the rows of the cage's own vertices come first. Rows are convex combinations.
  Eigen::SparseMatrix<double, Eigen::RowMajor> weights;
  std::vector<CageFace> faces;  // quads
};

// One step of Catmull and Clark, "Recursively generated B-spline surfaces on arbitrary topological meshes" (1978), on a
// closed manifold. Texture coordinates are refined within each face, so that charts keep their outline.
SubdividedCage subdivide(int vertex_count, const std::vector<CageFace>& faces);

// `steps` times subdivide().
SubdividedCage subdivide(int vertex_count, const std::vector<CageFace>& faces, int steps);

// Cage positions whose refined first rows come to lie on `wanted`: subdivision shrinks a cage, and a designer thinks of
// the surface. Damped fixed-point iterations, as the interpolation by Catmull-Clark surfaces of Halstead et al. (1993)
// solves it exactly; what is left after them is below a millimetre for a body-sized cage.
Eigen::MatrixXd cage_through(const Eigen::MatrixXd& wanted, const SubdividedCage& subdivision);

}  // namespace gyre
