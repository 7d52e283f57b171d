// SPDX-License-Identifier: Apache-2.0
// One averaged point per small cube and side of the surface.
#pragma once

#include "common/mesh/mesh.h"

namespace gyre {

// Points of one cube of `size` metres whose normals have the same dominant axis and sign are replaced by their
// confidence-weighted mean; the confidence becomes that of the best of them. Their errors come from the same views and
// from overlapping windows, so that the mean is no better than its parts: its variance is the square of their mean
// deviation plus the scatter of the points across the surface. `views` are not carried on, for which views see the new
// point is not a matter of sums. The output is ordered by cube, so that it depends only on the order of the input.
PointCloud thin_by_voxels(const PointCloud& cloud, double size);

}  // namespace gyre
