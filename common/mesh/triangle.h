// SPDX-License-Identifier: Apache-2.0
// Geometry of a single triangle.
#pragma once

#include <Eigen/Core>

namespace gyre {

// Barycentric weights of corners a, b, c at the point of the triangle closest to p (Ericson, Real-Time Collision
// Detection, 2005, section 5.1.5). They sum to 1 and none is negative; a triangle without area must have a corner or
// an edge as its answer, else the weights are not finite.
Eigen::Vector3d closest_weights(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                const Eigen::Vector3d& c);

}  // namespace gyre
