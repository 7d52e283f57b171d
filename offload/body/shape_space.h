// SPDX-License-Identifier: Apache-2.0
// The principal components of bodies.
#pragma once

#include <Eigen/Core>

namespace gyre {

struct ShapeSpace {
  Eigen::VectorXd mean;        // 3 a vertex
  Eigen::MatrixXd components;  // one a column, of one standard deviation length
  Eigen::VectorXd explained;   // share of the weighted variance, one a component
};

// Principal components of sample rows (samples x 3 vertices) by the eigenvectors of the samples' Gram matrix (Turk and
// Pentland 1991, section 2). weight: one a vertex, what its squared deviations count, so that dense regions of the mesh
// do not rule. The sign of each makes its largest entry positive.
ShapeSpace principal_components(const Eigen::MatrixXf& samples, const Eigen::VectorXd& weight, int count);

// For each sample row the mean distance of its vertices, weighted by `weight`, from the body that the first `count`
// components come closest to in weighted least squares: what a shape space does not know. Same units as the samples.
Eigen::VectorXd reconstruction_errors(const ShapeSpace& space, const Eigen::MatrixXf& samples,
                                      const Eigen::VectorXd& weight, int count);

}  // namespace gyre
