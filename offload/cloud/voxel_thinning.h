// SPDX-License-Identifier: Apache-2.0
// One averaged point per small cube and side of the surface.
#pragma once

#include "common/mesh/mesh.h"

namespace gyre {

// Points of one cube of `size` metres whose normals have the same dominant axis and sign are replaced by their
// confidence-weighted mean; the confidence becomes that of the best of them. The output is ordered by cube, so that it
// depends only on the order of the input.
PointCloud thin_by_voxels(const PointCloud& cloud, double size);

}  // namespace gyre
