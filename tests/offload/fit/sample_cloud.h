// SPDX-License-Identifier: Apache-2.0
// Clouds with known truth: points of a surface that cameras around it see.
#pragma once

#include "common/mesh/mesh.h"

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

namespace gyre {

struct SampleOptions {
  int points = 20000;
  double noise = 0.002;  // metres, standard deviation per axis
  int image_height = 300;
  std::uint64_t seed = 1;
};

// Points of the surface seen by a low and a high ring of cameras around the y axis, with the triangles' normals and
// Gaussian noise. What no camera sees (mouth, soles, inside of clothes) has no points.
PointCloud sample_visible(std::span<const Eigen::Vector3d> vertices, std::span<const Eigen::Vector3i> triangles,
                          const SampleOptions& options = {});

// The same points by themselves, without noise.
std::vector<Eigen::Vector3d> visible_points(std::span<const Eigen::Vector3d> vertices,
                                            std::span<const Eigen::Vector3i> triangles, int points, int image_height);

// The cloud turned by `yaw` radians about +Y, then shifted.
PointCloud moved(const PointCloud& cloud, double yaw, const Eigen::Vector3d& shift);

}  // namespace gyre
