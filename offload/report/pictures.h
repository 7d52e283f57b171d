// SPDX-License-Identifier: Apache-2.0
// The pictures of a report, and how they get into a page without files of their own.
#pragma once

#include "common/mesh/mesh.h"

#include <array>
#include <opencv2/core/mat.hpp>
#include <string>

namespace gyre {

// "data:image/jpeg;base64,..." of an 8-bit picture; `quality` of the JPEG, 0: a PNG instead. Empty for an empty
// picture.
std::string data_uri(const cv::Mat& image, int quality);

// RFC 4648 base 64 with padding.
std::string base64(std::string_view bytes);

// The cloud as small discs seen from `azimuth` (radians, 0: from +Z) at its middle height, 8-bit BGR on white.
cv::Mat render_cloud(const PointCloud& cloud, double azimuth, int width, int height);

// The mesh (facing +Z, soles near y = 0) from the front, its left, the back and its right, 8-bit BGR on white.
// Untextured when `texture` is empty.
std::array<cv::Mat, 4> render_turnaround(const TriangleMesh& mesh, const cv::Mat& texture, int width, int height);

}  // namespace gyre
