// SPDX-License-Identifier: Apache-2.0
// Pictures of the printed board through a lens that distorts, and a round of views such as a person takes.
#pragma once

#include "common/geometry/camera.h"
#include "common/geometry/pose.h"

#include <opencv2/core/mat.hpp>
#include <vector>

namespace gyre {

// As picture_of_board(), by a camera with distortion: 8-bit grey.
cv::Mat picture_through_lens(const Camera& camera, const Pose& cam_from_board);

// `count` views of the board in all parts of the picture and tilted to all sides, of which it fills about a third.
// tilt: largest, radians.
std::vector<Pose> round_of_views(const Camera& camera, int count, double tilt);

// Where the corners of the board are in such a picture, exactly.
std::vector<Eigen::Vector2d> true_corners(const Camera& camera, const Pose& cam_from_board);

}  // namespace gyre
