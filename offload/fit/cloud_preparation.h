// SPDX-License-Identifier: Apache-2.0
// What a cloud goes through before a body is fitted to it: strays and floor are dropped, the rest is thinned.
#pragma once

#include "common/mesh/mesh.h"
#include "common/result/result.h"
#include "offload/fit/point_index.h"

#include <cstddef>
#include <vector>

namespace gyre {

struct PreparationOptions {
  double cell = 0.04;             // metres; cells that touch belong together
  double smallest_share = 0.005;  // connected groups with a smaller share of the occupied cells are strays
  double floor_height = 0.03;     // metres; upward facing points below it are floor
};

// The points of the subject, weighed by the cloud's confidence and deviation where it has them. Errors: an empty cloud,
// a cloud without normals, numbers that are not finite throughout.
Result<OrientedPoints> prepare_cloud(const PointCloud& cloud, const PreparationOptions& options = {});

// One point for every occupied cell of a grid: the weighted mean of its points and normals, with the mean weight.
// Points whose normals oppose each other (both sides of a sleeve) stay apart. In the order of the first point of each
// cell.
OrientedPoints thin(const OrientedPoints& points, double cell);

// The grid cell at which `thin` leaves about `count` points (within a tenth, where the cloud allows).
double cell_for_count(const OrientedPoints& points, std::size_t count);

}  // namespace gyre
