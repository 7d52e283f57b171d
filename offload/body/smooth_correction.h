// SPDX-License-Identifier: Apache-2.0
// The smoothest motion of a patch of surface that meets linear conditions.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <array>
#include <memory>
#include <span>
#include <vector>

namespace gyre {

// direction . sum_k weights[k] d(vertices[k]) is at least `amount` metres, or exactly that. Entries with weight 0 are
// unused; direction is a unit vector. softness: how easily the condition gives way, against a typical Green's function;
// it settles contradictions and leaves out what is not smooth.
struct MotionCondition {
  std::array<int, 4> vertices{};
  std::array<double, 4> weights{};
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  double amount = 0.0;
  bool exact = false;
  double softness = 1e-3;
};

// Minimises the bending |L d|^2 of a displacement field d, with L the cotangent Laplacian and the norm weighed by area
// (Botsch and Kobbelt, An Intuitive Framework for Real-Time Freeform Modeling, SIGGRAPH 2004, k = 2), under conditions
// on a few vertices; d and its slope vanish where the patch ends. The answer is a combination of the patch's Green's
// functions, one for each vertex that conditions may name: they are computed once, and what is left to each call is a
// small dense problem with complementarity, solved by an active set.
class SmoothCorrection {
 public:
  // `movable` and `touchable` are vertex indices; touchable ones that cannot move may be named all the same.
  SmoothCorrection(std::span<const Eigen::Vector3d> vertices, std::span<const Eigen::Vector3i> triangles,
                   std::vector<int> movable, std::span<const int> touchable);

  // Displacements of movable(), metres: the least bending that meets the conditions. Those that contradict each other
  // are met as nearly as all of them allow.
  std::vector<Eigen::Vector3d> solve(std::span<const MotionCondition> conditions) const;

  const std::vector<int>& movable() const { return movable_; }

 private:
  std::vector<int> movable_;
  std::vector<int> column_;  // per vertex of the surface: its column in green_, -1: none
  Eigen::MatrixXd green_;    // movable x touchable
  std::vector<int> row_;     // per vertex of the surface: its row in green_, -1: held
};

// The cotangent Laplacian of a surface (symmetric, positive semi-definite) and a third of the area around each vertex.
// Triangles without area add nothing.
Eigen::SparseMatrix<double> cotangent_laplacian(std::span<const Eigen::Vector3d> vertices,
                                                std::span<const Eigen::Vector3i> triangles, Eigen::VectorXd& areas);

}  // namespace gyre
