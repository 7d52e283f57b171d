// SPDX-License-Identifier: Apache-2.0
// What the cameras have looked through: air, or something solid that shows no texture.
#pragma once

#include "common/geometry/pose.h"
#include "offload/cameras/scene.h"

#include <span>
#include <vector>

namespace gyre {

// A line from a camera to a point it sees, where it passes the vertical axis. Lengths in the unit of the scene.
struct SightLine {
  double height = 0.0;
  double distance = 0.0;  // from the axis
  double azimuth = 0.0;   // of its direction, in [0, pi): there and back are one
};

struct SightLineOptions {
  // Shares of the cameras' distance from the axis.
  double behind = 0.1;                         // a point must lie this far behind the axis to have been seen past it
  double through = 0.05;                       // lines that pass nearer than this go through the axis
  double beside_from = 0.15, beside_to = 0.3;  // and those that pass here say how many would if nothing stood there
  double level = 0.04;                         // height looked at as one
  int sectors = 6;                             // of the half turn of directions
  double min_expected = 5;                     // lines through a level in a sector, to say anything
  double max_share = 0.5;                      // of those expected, for the sector to be blocked
  double min_blocked = 1.0 / 3.0;              // of the sectors; from the front one sees through between two legs
};

// All lines that pass the y axis of the frame `upright`_from_scene with their point well behind it; of points that
// three views agree on. radius: the cameras' distance from the axis in that frame.
std::vector<SightLine> lines_past_axis(const Scene& scene, const Similarity& upright, double radius,
                                       const SightLineOptions& options = {});

// True when something stands on the axis between two heights: lines of sight pass beside it and not through it, at
// least from some directions, and no level is seen through. False also when too few lines pass to tell at most levels.
bool is_solid(std::span<const SightLine> lines, double low, double high, double radius,
              const SightLineOptions& options = {});

}  // namespace gyre
