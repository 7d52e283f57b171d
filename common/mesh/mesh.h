// SPDX-License-Identifier: Apache-2.0
// Plain data of a surface and of a cloud, as the stages exchange them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace gyre {

using Rgb = Eigen::Matrix<std::uint8_t, 3, 1>;

// An indexed triangle mesh. Optional arrays are empty or complete. Texture coordinates have their own indices, because
// a seam gives one vertex several of them; (0, 0) is the picture's top left corner, as in glTF.
struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices;   // metres
  std::vector<Eigen::Vector3i> triangles;  // counter-clockwise seen from outside
  std::vector<Eigen::Vector3d> normals;    // one a vertex, unit
  std::vector<Rgb> colours;                // one a vertex
  std::vector<Eigen::Vector2d> uv;
  std::vector<Eigen::Vector3i> uv_triangles;  // one a triangle, into uv
};

// An oriented point cloud. Optional arrays are empty or complete.
struct PointCloud {
  std::vector<Eigen::Vector3f> points;   // metres
  std::vector<Eigen::Vector3f> normals;  // unit, towards the cameras
  std::vector<Rgb> colours;
  std::vector<float> confidence;    // in [0, 1]
  std::vector<float> deviation;     // standard deviation of the point along its normal, metres
  std::vector<std::uint8_t> views;  // how many views see the surface where the point is; 255: that many or more
};

// Area-weighted unit normals, one a vertex (zero for a vertex without area).
std::vector<Eigen::Vector3d> vertex_normals(const std::vector<Eigen::Vector3d>& vertices,
                                            const std::vector<Eigen::Vector3i>& triangles);

}  // namespace gyre
