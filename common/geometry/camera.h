// SPDX-License-Identifier: Apache-2.0
// Pinhole camera with Brown distortion, and what image orientation does to it.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

namespace gyre {

// Pixels; the centre of the first pixel is (0.5, 0.5). Coefficients as OpenCV's k1 k2 p1 p2 k3 (Brown 1966).
struct Camera {
  int width = 0;
  int height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;

  // Camera without distortion whose larger side sees `fov` radians: the guess when nothing is known.
  static Camera from_fov(int width, int height, double fov);

  bool has_distortion() const { return k1 != 0 || k2 != 0 || p1 != 0 || p2 != 0 || k3 != 0; }

  // Pixel of a point in camera coordinates (metres); nothing when it lies behind the camera.
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& in_camera) const;

  // Distorted pixel of a normalised image point (x/z, y/z).
  Eigen::Vector2d pixel_from_normalised(const Eigen::Vector2d& xy) const;

  // Normalised image point of a distorted pixel, by Newton iterations on the distortion (converges to 1e-12 for the
  // lenses the model can describe).
  Eigen::Vector2d normalised_from_pixel(const Eigen::Vector2d& pixel) const;

  // The same lens on an image resized by `factor` (0.5: half as wide); the size is rounded to whole pixels and the
  // focal lengths follow the rounded size.
  Camera scaled(double factor) const;

  // The ideal pinhole camera with the same size, focal lengths and principal point.
  Camera without_distortion() const;
};

// EXIF orientation tag, 1 to 8: what must be done to the stored picture to show it upright.
enum class Orientation {
  upright = 1,
  mirrored = 2,
  rotated_180 = 3,
  flipped = 4,
  transposed = 5,
  rotated_90 = 6,
  transversed = 7,
  rotated_270 = 8
};

// The upright camera for a stored picture taken by `stored`. The mirrored cases (2, 4, 5, 7) negate p1 or p2 as the
// axes demand; fx/fy, cx/cy and width/height swap for 5 to 8.
Camera oriented(const Camera& stored, Orientation orientation);

// Pixel in the upright picture of a pixel in the stored one (of size width x height).
Eigen::Vector2d oriented(const Eigen::Vector2d& stored_pixel, int width, int height, Orientation orientation);

}  // namespace gyre
