// SPDX-License-Identifier: Apache-2.0
// How somebody stands, read off the cloud without landmarks, and the body that stands like that.
#pragma once

#include "offload/body/body_state.h"
#include "offload/fit/point_index.h"

#include <Eigen/Core>
#include <array>
#include <optional>

namespace gyre {

// What the two sides have; [0] lies towards +lateral.
struct StanceSide {
  std::optional<Eigen::Vector3d> hand;  // middle of the outermost part
  std::optional<Eigen::Vector3d> foot;  // middle of the lowest part
};

// Lengths in metres. The lateral axis runs through both arms; which of its ends is the left is not known here.
struct Stance {
  double floor = 0.0;
  double height = 0.0;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();    // on the floor below the trunk
  Eigen::Vector3d lateral = Eigen::Vector3d::UnitX();  // horizontal, unit
  double elongation = 1.0;  // spread along the lateral axis over spread across it, upper body; a person in A-pose: > 2
  std::array<StanceSide, 2> sides;
  // Where the feet point: their offset from the ankles across the lateral axis, towards lateral x up, in heights.
  // Feet without points give 0.
  double toes = 0.0;
};

// The cloud must hold at least one point; nothing else is assumed of it.
Stance measure_stance(const OrientedPoints& cloud);

// Heading of somebody whose left is +lateral (towards_left) or -lateral, radians counter-clockwise, 0 = facing +Z.
double heading(const Stance& stance, bool towards_left);

// The template at the height and place of the stance, turned to `yaw`, arms and legs along the measured ones. An arm or
// leg that was not seen takes the other one's angle, or that of an A-pose when neither was.
BodyState stand_like(const BodyTemplate& body, const Stance& stance, double yaw);

}  // namespace gyre
