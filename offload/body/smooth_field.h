// SPDX-License-Identifier: Apache-2.0
// Smooth vector fields on a part of a mesh from values at some of its vertices.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCholesky>
#include <memory>
#include <vector>

namespace gyre {

// Minimises  sum_i weight_i |d_i - value_i|^2 + stiffness |L d|^2  over displacements d of the active vertices, with d
// = 0 at all others; L is the graph's Laplacian, d_i less the mean of its neighbours (the thin plate energy of Sorkine
// et al., "Laplacian Surface Editing", 2004, without its rotations). The factorisation is kept.
class SmoothField {
 public:
  // active: one a vertex.
  SmoothField(std::size_t vertices, const std::vector<Eigen::Vector3i>& triangles, const std::vector<bool>& active);

  // weights: one a vertex, not negative; those of vertices that are not active do not count.
  void factorise(const Eigen::VectorXd& weights, double stiffness);

  // vertices x 3, for values of the same shape, with the weights of the last factorise().
  Eigen::MatrixXd solve(const Eigen::MatrixXd& values) const;

 private:
  std::vector<int> place_;               // of a vertex among the active ones, -1: none
  Eigen::Index count_ = 0;               // of active vertices
  Eigen::SparseMatrix<double> squared_;  // L^T L over the active ones
  Eigen::VectorXd weights_;              // of the active ones
  std::unique_ptr<Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>> solver_;
};

}  // namespace gyre
