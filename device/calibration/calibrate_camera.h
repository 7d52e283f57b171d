// SPDX-License-Identifier: Apache-2.0
// The lens of a camera from pictures of the printed board: Zhang, "A flexible new technique for camera calibration",
// PAMI 2000, as cv::calibrateCamera.
#pragma once

#include "common/board/find_board.h"
#include "common/geometry/camera.h"
#include "common/result/result.h"

#include <span>
#include <string>
#include <vector>

namespace gyre {

// What a calibration has to be for scans to trust it.
struct CalibrationOptions {
  int least_views = 12;
  double largest_error = 1.0 / 1500.0;  // root mean square distance of the corners, of the picture's longer side
  double least_covered = 0.6;           // see covered()
  double largest_focal_deviation = 0.01;

  Result<void> check() const;
};

struct Calibration {
  Camera camera;
  int views = 0;                 // that were used
  double error = 0.0;            // root mean square distance of the corners from where they are seen, pixels
  double covered = 0.0;          // see covered()
  double focal_deviation = 0.0;  // standard deviation of the focal length, of that length
};

using BoardView = std::vector<BoardCorner>;  // what find_board() found in a picture

// Corners from which a view counts: fewer do not say where the board is.
inline constexpr std::size_t least_corners = 4;

// Share of the parts of the picture, four by four, in which a corner was seen: a lens is only known there.
double covered(std::span<const BoardView> views, int width, int height);

// Regions of the picture with a part in which none was: "upper left", "middle", ...
std::vector<std::string> not_covered(std::span<const BoardView> views, int width, int height);

// Square pixels, k1, k2, p1 and p2. Views that fit three times worse than most are left out. Errors: what `options`
// refuse, with what to do about it. options.check() must hold.
Result<Calibration> calibrate_camera(std::span<const BoardView> views, int width, int height,
                                     const CalibrationOptions& options = {});

}  // namespace gyre
