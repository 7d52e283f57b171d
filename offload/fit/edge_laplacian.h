// SPDX-License-Identifier: Apache-2.0
// Surface deformation that keeps the rotated edge Laplacians of a reference surface.
#pragma once

#include "offload/fit/correspondences.h"

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

namespace gyre {

// Minimises, in turn over vertices x and edge rotations R_e,
//
//   E(x) = 1 / sum w_c  sum_c w_c |x_c - p_c|^2  +  stiffness / sum A_e  sum_e A_e |D_e x - R_e D_e xbar|^2
//
// (Wenninger et al., Realistic Virtual Humans from Smartphone Videos, VRST 2020, the terms E_close and E_reg). D_e is
// the area-based edge operator of He and Schaefer, Mesh Denoising via L0 Minimization, SIGGRAPH 2013, eq. 4: on the two
// triangles of an edge, zero for a flat pair; A_e is a third of their area. R_e is the rotation that best takes the
// one-rings of the edge's ends from xbar to x (Sorkine and Alexa, As-Rigid-As-Possible Surface Modeling, SGP 2007).
// D_e alone does not feel stretching within the surface, so where there is no data a sheet would run on with any
// stretch; `membrane` adds A_e membrane |(x_i - x_j) - R_e (xbar_i - xbar_j)|^2 for each edge, with the same rotations.
//
// The sparsity pattern never changes, because the corners of a triangle are coupled already: it is analysed once and
// kept, each solve only refactors.
class EdgeLaplacian {
 public:
  // reference: xbar. Triangles index it; edges with one triangle have no D_e. vertex_stiffness: empty, or a factor a
  // vertex; an edge's terms are multiplied by the mean of its ends'.
  EdgeLaplacian(std::vector<Eigen::Vector3d> reference, std::span<const Eigen::Vector3i> triangles,
                double membrane = 0.0, std::span<const double> vertex_stiffness = {});
  EdgeLaplacian(EdgeLaplacian&&) noexcept;
  EdgeLaplacian& operator=(EdgeLaplacian&&) noexcept;
  ~EdgeLaplacian();

  // Edge rotations from the reference to x.
  void fit_rotations(std::span<const Eigen::Vector3d> x, int threads);

  // The minimum over x for the rotations at hand (identity at first). Vertices that nothing holds stay at `x`.
  // Without any match the result is x.
  std::vector<Eigen::Vector3d> solve(std::span<const Match> matches, double stiffness,
                                     std::span<const Eigen::Vector3d> x) const;

  // The regularising term at x for the rotations at hand, in m^2, without the stiffness.
  double energy(std::span<const Eigen::Vector3d> x) const;

 private:
  struct System;
  std::unique_ptr<System> system_;
};

}  // namespace gyre
