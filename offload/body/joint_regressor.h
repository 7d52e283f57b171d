// SPDX-License-Identifier: Apache-2.0
// Joints as sparse combinations of surface vertices that follow the shape.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

namespace gyre {

struct JointRegressor {
  std::vector<std::pair<int, double>> weights;  // (vertex, weight); non-negative, sum 1
  double rms = 0;                               // metres, over the samples
};

// Non-negative weights with sum 1 over `candidates` that best give `wanted` (samples x 3, metres) from the samples'
// vertices (samples x 3 vertices): constrained least squares by coordinate descent on pairs of weights (the step of
// Platt's sequential minimal optimisation, 1998), started from equal weights, with a small pull towards them so that
// weights spread where the data does not decide. Being a convex combination, a joint stays inside its ring of vertices.
JointRegressor fit_regressor(const Eigen::MatrixXf& samples, const std::vector<int>& candidates,
                             const Eigen::MatrixXd& wanted);

// Up to `count` of `vertices`, spread around `joint`: those within five times the distance of the nearest one (and at
// least the nearest few hundred), thinned by farthest point sampling.
std::vector<int> vertices_around(const std::vector<Eigen::Vector3d>& positions, const std::vector<int>& vertices,
                                 const Eigen::Vector3d& joint, std::size_t count);

}  // namespace gyre
