// SPDX-License-Identifier: Apache-2.0
// Turns a stored picture upright.
#pragma once

#include "common/geometry/camera.h"

#include <opencv2/core/mat.hpp>

namespace gyre {

// The upright picture of a stored one, any type; the pixels move as oriented() of common/geometry says. Shares the
// data when the orientation is upright.
cv::Mat oriented(const cv::Mat& stored, Orientation orientation);

}  // namespace gyre
