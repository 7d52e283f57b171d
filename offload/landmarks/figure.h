// SPDX-License-Identifier: Apache-2.0
// How somebody in A-pose stands, read off the cloud: floor, height, the axis through both sides.
#pragma once

#include "offload/landmarks/surface_graph.h"

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace gyre {

// Lengths in metres. The lateral axis runs from side 1 to side 0; which of them is the left is for the facing to say.
struct Figure {
  SurfaceGraph graph;
  double floor = 0.0;
  double height = 0.0;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();    // on the floor below head and trunk
  Eigen::Vector3d lateral = Eigen::Vector3d::UnitX();  // horizontal, unit
  double elongation = 1.0;  // spread along the lateral axis over that across it, upper body; a person in A-pose: > 2

  // Horizontal, unit: where the subject faces if side 0 is its left, else away from there.
  Eigen::Vector3d across() const { return lateral.cross(Eigen::Vector3d::UnitY()); }
  // Height over the floor in statures.
  double level(const Eigen::Vector3d& p) const { return (p.y() - floor) / height; }
  // Offset from the middle towards a side (0 or 1), metres.
  double outward(const Eigen::Vector3d& p, int side) const {
    return (side == 0 ? 1.0 : -1.0) * (p - middle).dot(lateral);
  }
  double depth(const Eigen::Vector3d& p) const { return (p - middle).dot(across()); }
};

// Nothing when the cloud has too few points to be a person, or none of the upper body.
std::optional<Figure> measure_figure(const PointCloud& cloud);

}  // namespace gyre
