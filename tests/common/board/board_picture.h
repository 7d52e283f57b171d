// SPDX-License-Identifier: Apache-2.0
// Pictures of the printed board with exactly known corners.
#pragma once

#include "common/board/board.h"
#include "common/geometry/camera.h"
#include "common/geometry/pose.h"

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <span>

namespace gyre {

// Black rectangles (metres) on a white sheet, 8-bit grey, from the sheet's top left.
cv::Mat draw_sheet(std::span<const BoardRectangle> black, const Eigen::Vector2d& sheet, double pixels_a_metre);

// What a camera without distortion sees of the board on a sheet with 12 mm of margin, on a grey floor, with the blur of
// a lens and noise of 3 levels: 8-bit grey. The board's axes are those of board.h, z into the sheet.
cv::Mat picture_of_board(const Camera& camera, const Pose& cam_from_board);

// Where that camera sees an inner corner.
Eigen::Vector2d pixel_of_corner(const Camera& camera, const Pose& cam_from_board, int corner);

// A camera that looks at the middle of the board from `distance` metres, `elevation` radians above its plane and
// `azimuth` radians around it.
Pose look_at_board(double distance, double elevation, double azimuth);

}  // namespace gyre
