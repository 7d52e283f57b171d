// SPDX-License-Identifier: Apache-2.0
// The small CPU renderer: which triangle each pixel of a pinhole camera sees, and pictures made from that.
#pragma once

#include "common/geometry/camera.h"
#include "common/geometry/pose.h"
#include "common/mesh/mesh.h"

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <span>
#include <vector>

namespace gyre {

// What a camera sees, row major, width x height.
struct VisibilityBuffer {
  int width = 0;
  int height = 0;
  std::vector<float> depth;              // metres along z; infinity: nothing
  std::vector<std::int32_t> triangle;    // -1: nothing
  std::vector<Eigen::Vector2f> weights;  // perspective-correct barycentric weights of corners 1 and 2

  std::size_t index(int x, int y) const { return static_cast<std::size_t>(y) * width + x; }
};

struct RasteriseOptions {
  bool cull_back_faces = true;
  double near = 0.01;  // metres; triangles that reach nearer are left out
};

// Depth, triangle and weights at every pixel centre by z-buffered scan conversion with perspective-correct weights.
// Lens distortion is applied to the projected corners, so triangles must be small against its curvature.
VisibilityBuffer rasterise(std::span<const Eigen::Vector3d> vertices, std::span<const Eigen::Vector3i> triangles,
                           const Camera& camera, const Pose& cam_from_world, const RasteriseOptions& options = {});

struct ShadeOptions {
  bool lit = true;                                              // headlight shading; false: plain albedo
  Eigen::Vector3d background = Eigen::Vector3d(245, 245, 245);  // RGB
};

// 8-bit BGR picture of a mesh: from `texture` (BGR) through its texture coordinates when given (bilinear), else from
// its vertex colours, else light grey.
cv::Mat render(const TriangleMesh& mesh, const cv::Mat& texture, const Camera& camera, const Pose& cam_from_world,
               const ShadeOptions& options = {});

// Camera pose at `eye` looking at `target`, world up +Y (camera axes: x right, y down, z forward).
Pose look_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& target);

}  // namespace gyre
