// SPDX-License-Identifier: Apache-2.0
// An arm as a row of sections, from the tip of the fingers to the shoulder.
#pragma once

#include "offload/landmarks/figure.h"

#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

namespace gyre {

// Where nodes at one distance from the tip along the surface lie.
struct LimbSection {
  double along = 0.0;  // metres from the tip along the axis
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double width = 0.0;      // largest extent across the axis, metres
  std::vector<int> nodes;  // of the figure's graph
};

struct Arm {
  Eigen::Vector3d fingertip = Eigen::Vector3d::Zero();
  std::vector<LimbSection> sections;  // at equal distances along the surface, from the tip on
};

// The arm on one side (0 or 1): its tip is the node farthest from the trunk along the surface (accumulated geodesic
// extrema, Plagemann et al., "Real-time identification and localization of body parts from depth images", ICRA 2010),
// its sections are the level sets of the distance from there. Else why there is none.
tl::expected<Arm, std::string> trace_arm(const Figure& figure, int side);

// Centre of the arm at a distance from the tip, between sections; the ends where the distance is beyond them.
Eigen::Vector3d centre_at(const Arm& arm, double along);
// Unit direction of the axis there, towards the shoulder.
Eigen::Vector3d direction_at(const Arm& arm, double along);

// Distances from the tip in metres of the wrist (the narrowest section where hands end) and of the elbow (where the
// axis bends the most), each with its standard deviation; both are drawn towards their usual share of the stature
// (ANSUR II: hand 0.111, elbow to fingertip 0.273) the more, the less is to be seen.
struct Along {
  double distance = 0.0;
  double deviation = 0.0;
};
std::optional<Along> find_wrist(const Arm& arm, double stature);
std::optional<Along> find_elbow(const Arm& arm, double stature);

}  // namespace gyre
