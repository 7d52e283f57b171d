// SPDX-License-Identifier: Apache-2.0
// A part of the cloud as a height field over a plane: a face seen from the front.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <span>
#include <vector>

namespace gyre {

// Cells of `cell` metres over the plane z = 0 of `world_from_relief`; x to the right in the columns, y up in the rows.
struct Relief {
  Eigen::Isometry3d world_from_relief = Eigen::Isometry3d::Identity();
  double cell = 0.002;
  Eigen::Vector2d low = Eigen::Vector2d::Zero();  // corner of the first cell, metres
  int columns = 0, rows = 0;
  std::vector<float> height;     // metres along z; NaN where nothing is known
  std::vector<float> deviation;  // of the height, metres: 0 where it was measured, more where a hole was filled

  std::size_t index(int column, int row) const { return static_cast<std::size_t>(row) * columns + column; }
  Eigen::Vector2d centre(int column, int row) const { return low + cell * Eigen::Vector2d(column + 0.5, row + 0.5); }
  bool inside(int column, int row) const { return column >= 0 && row >= 0 && column < columns && row < rows; }
  // Height at a place by bilinear interpolation; NaN outside and next to unknown cells.
  double at(const Eigen::Vector2d& place) const;
  Eigen::Vector3d world_point(const Eigen::Vector2d& place) const {
    return world_from_relief * Eigen::Vector3d(place.x(), place.y(), at(place));
  }
};

struct ReliefOptions {
  double cell = 0.002;
  Eigen::Vector2d low = Eigen::Vector2d(-0.08, -0.11);
  Eigen::Vector2d high = Eigen::Vector2d(0.08, 0.09);
  double depth = 0.012;   // points this far behind the foremost of a cell belong to another surface, metres
  double smooth = 0.002;  // standard deviation of the smoothing, metres
  double fill = 0.008;    // holes are filled where something is known this near, metres
};

// Heights are means of the foremost points, smoothed by normalised convolution (Knutsson and Westin, CVPR 1993), which
// also closes small holes. Points are in the world.
Relief make_relief(std::span<const Eigen::Vector3d> points, const Eigen::Isometry3d& world_from_relief,
                   const ReliefOptions& options = {});

}  // namespace gyre
