// SPDX-License-Identifier: Apache-2.0
// Square markers of OpenCV's dictionary DICT_4X4_50, the one with the largest modules; the only file that knows which
// version of OpenCV's marker interface is there (contributed until 4.6, in its core since 4.7).
#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace gyre {

inline constexpr int marker_modules = 6;  // a side, with the black border

// [row][column], true: black.
using MarkerModules = std::array<std::array<bool, marker_modules>, marker_modules>;
MarkerModules black_modules(int id);

struct FoundMarker {
  int id = 0;
  // From the marker's top left clockwise; OpenCV's pixels, where (0, 0) is the centre of the first. They lie on
  // outlines and are a pixel wrong at times.
  std::array<cv::Point2f, 4> corners;
};
// Markers in an 8-bit grey picture (Garrido-Jurado et al., Pattern Recognition 2014) whose outline is longer than 2 %
// of the picture's longer side.
std::vector<FoundMarker> find_markers(const cv::Mat& grey);

}  // namespace gyre
