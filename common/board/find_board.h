// SPDX-License-Identifier: Apache-2.0
// The printed board in a picture.
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace gyre {

struct BoardCorner {
  int corner = 0;  // as board_corner() counts
  Eigen::Vector2d pixel;
};

// Inner corners of the board that are seen in an 8-bit grey or BGR picture, by corner; pixels as in
// common/geometry/camera.h. Empty when fewer than two of its markers are found, or no plane carries them. Markers tell
// where the board is; its corners are then refined in the picture seen straight on, where a corner's surroundings are
// symmetric at any angle of view (Förstner and Gülch, ISPRS 1987, as cv::cornerSubPix). The result does not depend on
// threads.
std::vector<BoardCorner> find_board(const cv::Mat& picture);

}  // namespace gyre
