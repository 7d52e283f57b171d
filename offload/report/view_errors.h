// SPDX-License-Identifier: Apache-2.0
// How far colours of re-rendered views are from the photographs.
#pragma once

#include "common/geometry/camera.h"
#include "common/geometry/pose.h"
#include "common/mesh/mesh.h"

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core/mat.hpp>

namespace gyre {

// CIE 1976 L*a*b* of an 8-bit sRGB colour: linearised (IEC 61966-2-1), to XYZ, against the white of D65.
Eigen::Vector3d lab_from_srgb(std::uint8_t red, std::uint8_t green, std::uint8_t blue);

// Sum over pixels of |Lab difference|^2 and their number: add them over views, then root of the mean.
struct ColourError {
  double squared = 0.0;
  std::int64_t pixels = 0;

  double rmse() const;  // 0 without pixels
};

// Compares two 8-bit BGR pictures of one size where both masks (CV_8U) are not zero.
ColourError colour_error(const cv::Mat& a, const cv::Mat& b, const cv::Mat& mask_a, const cv::Mat& mask_b);

// 255 where the camera sees the mesh.
cv::Mat silhouette(const TriangleMesh& mesh, const Camera& camera, const Pose& cam_from_world);

}  // namespace gyre
