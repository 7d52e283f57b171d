// SPDX-License-Identifier: Apache-2.0
// The printed board that gives a scan its scale: a chessboard whose white squares carry markers (ChArUco), laid out as
// OpenCV does since 4.6. Few and large squares, as it lies two metres from the camera and is seen at a flat angle: of
// boards that fill a sheet, this one is found in most views.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace gyre {

// Lengths in metres. Axes of the board: x right and y down the sheet, origin at the outer corner of the top-left
// square.
inline constexpr int board_version = 1;  // printed on it; raised, with other markers, when anything below changes
inline constexpr int board_columns = 3;
inline constexpr int board_rows = 4;
inline constexpr double board_square = 0.060;
inline constexpr double board_marker = 0.048;
inline constexpr double board_width = board_columns * board_square;
inline constexpr double board_height = board_rows * board_square;

// Inner corners, where four squares meet: row by row from the top left.
inline constexpr int board_corner_count = (board_columns - 1) * (board_rows - 1);
Eigen::Vector2d board_corner(int corner);

struct BoardMarker {
  int id = 0;                // in the dictionary of markers.h
  Eigen::Vector2d top_left;  // its sides are parallel to the board's
};
// One a white square, row by row.
std::vector<BoardMarker> board_markers();

struct BoardRectangle {
  Eigen::Vector2d top_left;
  Eigen::Vector2d size;
};
// What is black on white paper: squares, and the modules of markers in runs along a row. They touch, but none overlap.
std::vector<BoardRectangle> black_rectangles();

}  // namespace gyre
