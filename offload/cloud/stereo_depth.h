// SPDX-License-Identifier: Apache-2.0
// The depth map of a view.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace gyre {

// What is known of a pixel.
enum class PixelState : std::uint8_t {
  unknown,
  beyond,   // matched at a smaller pyramid level, outside the region: depth only
  surface,  // depth, normal and cost
};

// Depth of each pixel of a view at its working size, row major.
struct StereoDepth {
  int width = 0;
  int height = 0;
  std::vector<PixelState> state;
  std::vector<float> depth;             // metres along the optical axis; 0 for unknown
  std::vector<Eigen::Vector3f> normal;  // unit, in camera coordinates, towards the camera
  std::vector<float> cost;              // matching cost, 0 best

  std::size_t index(int x, int y) const { return static_cast<std::size_t>(y) * width + x; }
};

}  // namespace gyre
