// SPDX-License-Identifier: Apache-2.0
// Carries deformations of one surface over to another of the same topology.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

namespace gyre {

// Deformation transfer (Sumner and Popovic, Deformation Transfer for Triangle Meshes, SIGGRAPH 2004) as the Poisson
// problem that it is for surfaces of one topology (Botsch, Sumner, Pauly and Gross, Deformation Transfer for
// Detail-Preserving Surface Editing, VMV 2006): the displacement d of the target minimises
//
//   sum_t area_t | grad d - (R S_t R^T - 1) P_t |^2
//
// over its triangles t, with S_t the gradient of the source triangle's deformation (its normal follows as in Sumner and
// Popovic, section 3), P_t the projection into the target triangle, and R the turn of the target's frame against the
// source's. Solved for the displacement and not for positions, so no motion gives exactly none, and a surface
// transferred to itself gets back what it was given.
//
// The matrix depends on the target alone: it is factored once, for any number of deformations.
class DeformationTransfer {
 public:
  // source and target: rest vertices, metres, as many of each; `triangles` index both. movable: one a vertex; the
  // others stay where they are. target_from_source: R.
  DeformationTransfer(std::span<const Eigen::Vector3d> source, std::span<const Eigen::Vector3d> target,
                      std::span<const Eigen::Vector3i> triangles, const std::vector<bool>& movable,
                      const Eigen::Matrix3d& target_from_source = Eigen::Matrix3d::Identity());
  DeformationTransfer(DeformationTransfer&&) noexcept;
  DeformationTransfer& operator=(DeformationTransfer&&) noexcept;
  ~DeformationTransfer();

  // Displacements of the target for displacements of the source: vertices x 3 k, metres, three columns a deformation.
  Eigen::MatrixXd transfer(const Eigen::MatrixXd& source_offsets) const;

 private:
  struct System;
  std::unique_ptr<System> system_;
};

// One deformation, without keeping the factorisation.
std::vector<Eigen::Vector3d> transfer_deformation(std::span<const Eigen::Vector3d> source,
                                                  std::span<const Eigen::Vector3d> deformed_source,
                                                  std::span<const Eigen::Vector3d> target,
                                                  std::span<const Eigen::Vector3i> triangles);

}  // namespace gyre
