// SPDX-License-Identifier: Apache-2.0
#include "common/board/board.h"

#include "common/board/markers.h"

namespace gyre {

namespace {

bool is_black(int column, int row) {
  return (column + row) % 2 == 0;
}

Eigen::Vector2d place(int column, int row) {
  return board_square * Eigen::Vector2d(column, row);
}

}  // namespace

Eigen::Vector2d board_corner(int corner) {
  return place(1 + corner % (board_columns - 1), 1 + corner / (board_columns - 1));
}

std::vector<BoardMarker> board_markers() {
  std::vector<BoardMarker> markers;
  for (int row = 0; row < board_rows; ++row) {
    for (int column = 0; column < board_columns; ++column) {
      if (is_black(column, row)) continue;
      const Eigen::Vector2d gap = Eigen::Vector2d::Constant(0.5 * (board_square - board_marker));
      markers.push_back({static_cast<int>(markers.size()), place(column, row) + gap});
    }
  }
  return markers;
}

std::vector<BoardRectangle> black_rectangles() {
  std::vector<BoardRectangle> rectangles;
  for (int row = 0; row < board_rows; ++row)
    for (int column = 0; column < board_columns; ++column)
      if (is_black(column, row)) rectangles.push_back({place(column, row), {board_square, board_square}});
  const double module = board_marker / marker_modules;
  for (const BoardMarker& marker : board_markers()) {
    const MarkerModules black = black_modules(marker.id);
    for (int row = 0; row < marker_modules; ++row) {
      for (int begin = 0, end = 0; begin < marker_modules; begin = end + 1) {
        end = begin;
        while (end < marker_modules && black[static_cast<std::size_t>(row)][static_cast<std::size_t>(end)]) ++end;
        if (end == begin) continue;
        rectangles.push_back(
            {marker.top_left + module * Eigen::Vector2d(begin, row), {module * (end - begin), module}});
      }
    }
  }
  return rectangles;
}

}  // namespace gyre
