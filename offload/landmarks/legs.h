// SPDX-License-Identifier: Apache-2.0
// Feet, and the fork between the legs.
#pragma once

#include "offload/landmarks/figure.h"

#include <array>
#include <optional>
#include <vector>

namespace gyre {

// A foot or shoe on the floor. Which end has the toes is not known until the facing is.
struct Foot {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  // horizontal, unit, along the foot, towards across()
  double length = 0.0;                              // metres along the axis
  std::vector<int> nodes;                           // of the figure's graph
  // How far the shin stands behind the foot's middle, in foot lengths along the axis; about 0.2 when the toes lie
  // towards across(), -0.2 when they lie the other way. Nothing without a shin.
  std::optional<double> shin_offset;
  // How much higher the end away from across() is than the other, in statures: shoes and feet are high at the heel.
  double heel_rise = 0.0;
};

// The foot of each side; nothing where the cloud has none, or only a part that is shorter than a foot.
std::array<std::optional<Foot>, 2> find_feet(const Figure& figure);

// The fork: the highest place with free space between the legs, on the middle of that gap.
// Nothing when the legs are not apart in the cloud (a skirt, a coat).
std::optional<Eigen::Vector3d> find_crotch(const Figure& figure, const PointCloud& cloud);

// Nodes of one leg between two levels.
std::vector<int> leg_nodes(const Figure& figure, int side, double low_level, double high_level);

}  // namespace gyre
