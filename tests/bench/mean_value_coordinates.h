// SPDX-License-Identifier: Apache-2.0
// A point as a combination of the vertices of the closed surface around it.
#pragma once

#include <Eigen/Core>
#include <span>

namespace gyre {

// Weights of the vertices of a closed triangle mesh that give `point` back (Ju, Schaefer and Warren, Mean Value
// Coordinates for Closed Triangular Meshes, SIGGRAPH 2005, figure 4). They sum to 1, are smooth in the point, and on
// the surface they are the barycentric weights of the triangle hit, so a linear motion of the vertices moves the point
// alike. Some may be negative when the surface is not convex. Nearer to a triangle than some 1e-5 of its size a point
// counts as on it. Vertices that no triangle uses get 0. The bench carries joints along by them, to compare with the
// template's regressors.
Eigen::VectorXd mean_value_coordinates(std::span<const Eigen::Vector3d> vertices,
                                       std::span<const Eigen::Vector3i> triangles, const Eigen::Vector3d& point);

}  // namespace gyre
