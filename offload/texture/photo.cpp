// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/photo.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

namespace gyre {

namespace {

// Catmull-Rom weights for the four samples around a position `t` after the second of them.
std::array<float, 4> catmull_rom(float t) {
  return {t * (-0.5F + t * (1.0F - 0.5F * t)), 1.0F + t * t * (-2.5F + 1.5F * t), t * (0.5F + t * (2.0F - 1.5F * t)),
          t * t * (-0.5F + 0.5F * t)};
}

}  // namespace

void crop_to(Photo& photo, std::span<const Eigen::Vector3d> vertices, int margin) {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d high = -low;
  for (const Eigen::Vector3d& v : vertices) {
    const auto pixel = photo.camera.project(photo.cam_from_world * v);
    if (!pixel) continue;
    // Points far outside the picture may land anywhere under the distortion polynomial; they only widen the cut.
    low = low.cwiseMin(*pixel);
    high = high.cwiseMax(*pixel);
  }
  const auto bounded = [margin](double value, int side, int limit) {
    return static_cast<int>(std::clamp(value + side * margin, 0.0, static_cast<double>(limit)));
  };
  int x0 = 0, y0 = 0, x1 = 1, y1 = 1;
  if (low.x() <= high.x()) {
    x0 = std::min(bounded(std::floor(low.x()), -1, photo.image.cols), photo.image.cols - 1);
    y0 = std::min(bounded(std::floor(low.y()), -1, photo.image.rows), photo.image.rows - 1);
    x1 = std::max(bounded(std::ceil(high.x()), 1, photo.image.cols), x0 + 1);
    y1 = std::max(bounded(std::ceil(high.y()), 1, photo.image.rows), y0 + 1);
  }
  photo.image = photo.image(cv::Rect(x0, y0, x1 - x0, y1 - y0)).clone();
  photo.camera.width = x1 - x0;
  photo.camera.height = y1 - y0;
  photo.camera.cx -= x0;
  photo.camera.cy -= y0;
}

Eigen::Vector2d shifted(const Photo& photo, const Eigen::Vector2d& pixel) {
  if (photo.shift.empty()) return pixel;
  const Eigen::Vector2d at = ((pixel.array() - 0.5) / photo.shift_grid).max(0.0).matrix();
  const int x = std::min(static_cast<int>(at.x()), photo.shift.cols - 2);
  const int y = std::min(static_cast<int>(at.y()), photo.shift.rows - 2);
  const auto a = static_cast<float>(std::min(at.x() - x, 1.0));
  const auto b = static_cast<float>(std::min(at.y() - y, 1.0));
  const cv::Vec2f shift =
      (1 - b) * ((1 - a) * photo.shift.at<cv::Vec2f>(y, x) + a * photo.shift.at<cv::Vec2f>(y, x + 1)) +
      b * ((1 - a) * photo.shift.at<cv::Vec2f>(y + 1, x) + a * photo.shift.at<cv::Vec2f>(y + 1, x + 1));
  return pixel + Eigen::Vector2d(shift[0], shift[1]);
}

Eigen::Vector3f sample_raw(const Photo& photo, const Eigen::Vector2d& pixel) {
  const Eigen::Vector2d place = shifted(photo, pixel);
  const double x = place.x() - 0.5;
  const double y = place.y() - 0.5;
  const int x0 = static_cast<int>(std::floor(x));
  const int y0 = static_cast<int>(std::floor(y));
  const std::array<float, 4> wx = catmull_rom(static_cast<float>(x - x0));
  const std::array<float, 4> wy = catmull_rom(static_cast<float>(y - y0));
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (int j = 0; j < 4; ++j) {
    const auto* row = photo.image.ptr<cv::Vec3b>(std::clamp(y0 - 1 + j, 0, photo.image.rows - 1));
    Eigen::Vector3f line = Eigen::Vector3f::Zero();
    for (int i = 0; i < 4; ++i) {
      const cv::Vec3b& c = row[std::clamp(x0 - 1 + i, 0, photo.image.cols - 1)];
      line += wx[i] * Eigen::Vector3f(c[0], c[1], c[2]);
    }
    sum += wy[j] * line;
  }
  return sum.cwiseMax(0.0F).cwiseMin(255.0F);
}

}  // namespace gyre
