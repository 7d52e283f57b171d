// SPDX-License-Identifier: Apache-2.0
#include "offload/report/view_errors.h"

#include "common/render/rasterise.h"

#include <array>
#include <cmath>
#include <opencv2/core.hpp>

namespace gyre {

namespace {

const std::array<double, 256>& linear_of_code() {
  static const std::array<double, 256> table = [] {
    std::array<double, 256> t{};
    for (int i = 0; i < 256; ++i) {
      const double e = i / 255.0;
      t[i] = e <= 0.04045 ? e / 12.92 : std::pow((e + 0.055) / 1.055, 2.4);
    }
    return t;
  }();
  return table;
}

// The cube root of CIE 15:2004, eq. 8.6, with its straight part near black.
double lab_curve(double t) {
  constexpr double edge = 6.0 / 29.0;
  return t > edge * edge * edge ? std::cbrt(t) : t / (3 * edge * edge) + 4.0 / 29.0;
}

}  // namespace

Eigen::Vector3d lab_from_srgb(std::uint8_t red, std::uint8_t green, std::uint8_t blue) {
  const auto& linear = linear_of_code();
  const double r = linear[red], g = linear[green], b = linear[blue];
  const double x = 0.4124564 * r + 0.3575761 * g + 0.1804375 * b;
  const double y = 0.2126729 * r + 0.7151522 * g + 0.0721750 * b;
  const double z = 0.0193339 * r + 0.1191920 * g + 0.9503041 * b;
  // The white is what the matrix gives for (1, 1, 1), so that greys have a* = b* = 0.
  const double fx = lab_curve(x / 0.9504700), fy = lab_curve(y / 1.0000001), fz = lab_curve(z / 1.0888300);
  return {116 * fy - 16, 500 * (fx - fy), 200 * (fy - fz)};
}

double ColourError::rmse() const {
  return pixels > 0 ? std::sqrt(squared / static_cast<double>(pixels)) : 0.0;
}

ColourError colour_error(const cv::Mat& a, const cv::Mat& b, const cv::Mat& mask_a, const cv::Mat& mask_b) {
  ColourError error;
  for (int y = 0; y < a.rows; ++y)
    for (int x = 0; x < a.cols; ++x) {
      if (mask_a.at<std::uint8_t>(y, x) == 0 || mask_b.at<std::uint8_t>(y, x) == 0) continue;
      const auto& p = a.at<cv::Vec3b>(y, x);
      const auto& q = b.at<cv::Vec3b>(y, x);
      error.squared += (lab_from_srgb(p[2], p[1], p[0]) - lab_from_srgb(q[2], q[1], q[0])).squaredNorm();
      ++error.pixels;
    }
  return error;
}

cv::Mat silhouette(const TriangleMesh& mesh, const Camera& camera, const Pose& cam_from_world) {
  RasteriseOptions options;
  options.cull_back_faces = false;  // an open shell has a silhouette too
  const VisibilityBuffer seen = rasterise(mesh.vertices, mesh.triangles, camera, cam_from_world, options);
  cv::Mat mask(seen.height, seen.width, CV_8U);
  for (int y = 0; y < seen.height; ++y)
    for (int x = 0; x < seen.width; ++x) mask.at<std::uint8_t>(y, x) = seen.triangle[seen.index(x, y)] >= 0 ? 255 : 0;
  return mask;
}

}  // namespace gyre
