// SPDX-License-Identifier: Apache-2.0
#include "common/geometry/camera.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace gyre {

namespace {

Eigen::Vector2d distort(const Camera& c, const Eigen::Vector2d& p, Eigen::Matrix2d* jacobian) {
  const double x = p.x();
  const double y = p.y();
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (c.k1 + r2 * (c.k2 + r2 * c.k3));
  if (jacobian != nullptr) {
    const double slope = c.k1 + r2 * (2.0 * c.k2 + r2 * 3.0 * c.k3);  // d radial / d r2
    (*jacobian)(0, 0) = radial + 2.0 * x * x * slope + 2.0 * c.p1 * y + 6.0 * c.p2 * x;
    (*jacobian)(0, 1) = 2.0 * x * y * slope + 2.0 * c.p1 * x + 2.0 * c.p2 * y;
    (*jacobian)(1, 0) = 2.0 * x * y * slope + 2.0 * c.p1 * x + 2.0 * c.p2 * y;
    (*jacobian)(1, 1) = radial + 2.0 * y * y * slope + 6.0 * c.p1 * y + 2.0 * c.p2 * x;
  }
  return {x * radial + 2.0 * c.p1 * x * y + c.p2 * (r2 + 2.0 * x * x),
          y * radial + c.p1 * (r2 + 2.0 * y * y) + 2.0 * c.p2 * x * y};
}

}  // namespace

Camera Camera::from_fov(int width, int height, double fov) {
  const double f = 0.5 * std::max(width, height) / std::tan(0.5 * fov);
  return {.width = width, .height = height, .fx = f, .fy = f, .cx = 0.5 * width, .cy = 0.5 * height};
}

std::optional<Eigen::Vector2d> Camera::project(const Eigen::Vector3d& in_camera) const {
  if (in_camera.z() <= 0.0) return std::nullopt;
  return pixel_from_normalised(in_camera.head<2>() / in_camera.z());
}

Eigen::Vector2d Camera::pixel_from_normalised(const Eigen::Vector2d& xy) const {
  const Eigen::Vector2d d = distort(*this, xy, nullptr);
  return {fx * d.x() + cx, fy * d.y() + cy};
}

Eigen::Vector2d Camera::normalised_from_pixel(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d target((pixel.x() - cx) / fx, (pixel.y() - cy) / fy);
  if (!has_distortion()) return target;
  Eigen::Vector2d p = target;
  for (int i = 0; i < 20; ++i) {
    Eigen::Matrix2d jacobian;
    const Eigen::Vector2d residual = distort(*this, p, &jacobian) - target;
    const double determinant = jacobian.determinant();
    if (std::abs(determinant) < 1e-9) break;  // beyond the radius where the model folds over: keep the last point
    const Eigen::Vector2d step = jacobian.inverse() * residual;
    p -= step;
    if (step.squaredNorm() < 1e-28) break;
  }
  return p;
}

Camera Camera::scaled(double factor) const {
  Camera c = *this;
  c.width = std::max(1, static_cast<int>(std::lround(width * factor)));
  c.height = std::max(1, static_cast<int>(std::lround(height * factor)));
  const double sx = static_cast<double>(c.width) / width;
  const double sy = static_cast<double>(c.height) / height;
  c.fx *= sx;
  c.cx *= sx;
  c.fy *= sy;
  c.cy *= sy;
  return c;
}

Camera Camera::without_distortion() const {
  Camera c = *this;
  c.k1 = c.k2 = c.p1 = c.p2 = c.k3 = 0.0;
  return c;
}

Eigen::Vector2d oriented(const Eigen::Vector2d& stored_pixel, int width, int height, Orientation orientation) {
  const double x = stored_pixel.x();
  const double y = stored_pixel.y();
  const double w = width;
  const double h = height;
  switch (orientation) {
    case Orientation::upright:
      return {x, y};
    case Orientation::mirrored:
      return {w - x, y};
    case Orientation::rotated_180:
      return {w - x, h - y};
    case Orientation::flipped:
      return {x, h - y};
    case Orientation::transposed:
      return {y, x};
    case Orientation::rotated_90:
      return {h - y, x};
    case Orientation::transversed:
      return {h - y, w - x};
    case Orientation::rotated_270:
      return {y, w - x};
  }
  return {x, y};
}

Camera oriented(const Camera& stored, Orientation orientation) {
  Camera c = stored;
  const Eigen::Vector2d principal = oriented({stored.cx, stored.cy}, stored.width, stored.height, orientation);
  c.cx = principal.x();
  c.cy = principal.y();
  // The map of normalised coordinates is a signed permutation; p2 belongs to the x axis and p1 to the y axis.
  const Eigen::Vector2d sum =
      oriented({1, 0}, 0, 0, orientation) * stored.p2 + oriented({0, 1}, 0, 0, orientation) * stored.p1;
  c.p2 = sum.x();
  c.p1 = sum.y();
  if (static_cast<int>(orientation) >= 5) {
    std::swap(c.width, c.height);
    std::swap(c.fx, c.fy);
  }
  return c;
}

}  // namespace gyre
