// SPDX-License-Identifier: Apache-2.0
// What a photograph does to every measurement in it (exposure, white balance, blur), told apart from what the surface
// is.
#pragma once

#include "offload/texture/observations.h"
#include "offload/texture/photo.h"

#include <Eigen/Core>
#include <span>
#include <vector>

namespace gyre {

// One measurement of thing `item` in photograph `view`.
struct Measurement {
  int item = 0;
  int view = 0;
  double value = 0.0;
};

// Effects e of the additive model value = e[view] + a[item] + noise: least squares with Huber weights of width `scale`,
// a[item] eliminated, mean effect 0. Measurements are grouped by item. `prior` pulls every effect to 0 as that many
// measurements would; a view that shares no item with another keeps 0.
std::vector<double> view_effects(std::span<const Measurement> measurements, int views, double scale, double prior);

// Gain a channel (BGR, linear light) that brings every photograph to the common exposure: the joint log-gain least
// squares of panorama stitching (Brown and Lowe, IJCV 2007, eq. 28-29), over triangles instead of image overlaps.
std::vector<Eigen::Vector3d> exposure_gains(const ObservationTable& table, int photos);

// Sharpness of every photograph against the others that see the same surface, as a factor in (0, 1]: 1 for the
// sharper half of its pass. Compared within a pass, because a closer camera spreads the same detail over more pixels.
std::vector<double> relative_sharpness(const ObservationTable& table, std::span<const Photo> photos);

}  // namespace gyre
