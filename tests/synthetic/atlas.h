// SPDX-License-Identifier: Apache-2.0
// A picture of the subject's solid texture for programs that need texture coordinates.
#pragma once

#include "tests/synthetic/capture.h"

#include <opencv2/core/mat.hpp>

namespace gyre::synthetic {

// Gives every two triangles a square cell of a `size` pixel picture, writes texture coordinates into `mesh` (which has
// the subject's triangles) and returns the albedo as 8-bit BGR. Cells are filled to their borders, so that bilinear
// sampling never mixes neighbours.
cv::Mat bake_atlas(const Capture& capture, TriangleMesh& mesh, int size);

}  // namespace gyre::synthetic
