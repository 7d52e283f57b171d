// SPDX-License-Identifier: Apache-2.0
// Surface deformation that keeps the rotated edge Laplacians of a reference surface.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

namespace gyre {

// Minimises, in turn over vertices x and edge rotations R_e,
//
//   E(x) = sum_v w_v |x_v - t_v|^2  +  stiffness / sum A_e  sum_e A_e |D_e x - R_e D_e xbar|^2
//
// (Wenninger et al., Realistic Virtual Humans from Smartphone Videos, VRST 2020, the terms E_close and E_reg). D_e is
// the area-based edge operator of He and Schaefer, Mesh Denoising via L0 Minimization, SIGGRAPH 2013, eq. 4: on the two
// triangles of an edge, zero for a flat pair; A_e is a third of their area. R_e is the rotation that best takes the
// one-rings of the edge's ends from xbar to x (Sorkine and Alexa, As-Rigid-As-Possible Surface Modeling, SGP 2007).
// D_e alone does not feel stretching within the surface, so where there is no data a sheet would run on with any
// stretch; `membrane` (metres) adds A_e membrane^2 |(x_i - x_j) - R_e (xbar_i - xbar_j)|^2 / |xbar_i - xbar_j|^2 for
// each edge, with the same rotations. Against data of even density that smooths over membrane sqrt(stiffness) metres,
// whatever the size of the triangles.
//
// The matrix depends on weights and stiffness only: targets and rotations change the right-hand side, so one
// factorisation serves any number of them. The analysis of the pattern is kept for good.
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

  // Factorises for the weights w_v (one a vertex, none negative) and the stiffness. False when the numbers do not allow
  // it; the solver must not be asked then.
  bool factorise(std::span<const double> weights, double stiffness);

  // The minimum over x for the last factorisation, the rotations at hand (identity at first) and the targets t_v (one a
  // vertex; not looked at where the weight is 0). Vertices that nothing holds stay at `x`.
  std::vector<Eigen::Vector3d> solve(std::span<const Eigen::Vector3d> targets,
                                     std::span<const Eigen::Vector3d> x) const;

  // The regularising term at x for the rotations at hand, in m^2, without the stiffness.
  double energy(std::span<const Eigen::Vector3d> x) const;

 private:
  struct System;
  std::unique_ptr<System> system_;
};

}  // namespace gyre
