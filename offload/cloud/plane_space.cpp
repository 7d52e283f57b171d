// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/plane_space.h"

#include <Eigen/LU>
#include <algorithm>

namespace gyre {

using Eigen::Vector3f;

PlaneSpace::PlaneSpace(const StereoView& view, int level, const SubjectRegion& region, float reach)
    : width_(view.levels[level].image.width),
      height_(view.levels[level].image.height),
      world_from_cam_(view.cam_from_world.inverse()),
      k_(view.levels[level].index_from_camera.cast<float>()),
      k_inverse_(view.levels[level].index_from_camera.inverse().cast<float>()),
      up_((view.cam_from_world.rotation * Eigen::Vector3d::UnitY()).cast<float>()),
      ranges_(static_cast<std::size_t>(width_) * height_) {
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      const auto hit =
          intersect(region, world_from_cam_.translation, world_from_cam_.rotation * ray(x, y).cast<double>());
      if (!hit || hit->far < 1e-3) continue;
      const float near = std::max(static_cast<float>(hit->near), 0.02F * static_cast<float>(hit->far));
      ranges_[index(x, y)] = {1.0F / (reach * static_cast<float>(hit->far)), 1.0F / near};
    }
  }
}

// n . X = d gives 1 / z = (n . ray) / d, and ray is affine in the index.
SlantedPlane PlaneSpace::plane_from(int x, int y, float inverse, const Vector3f& normal) const {
  const float scale = inverse / normal.dot(ray(x, y));
  return {inverse, scale * normal.x() * k_inverse_(0, 0), scale * normal.y() * k_inverse_(1, 1)};
}

Vector3f PlaneSpace::normal_of(const SlantedPlane& plane, int x, int y) const {
  const float a = plane.slope_x * k_(0, 0);
  const float b = plane.slope_y * k_(1, 1);
  const Vector3f r = ray(x, y);
  return -Vector3f(a, b, plane.inverse - a * r.x() - b * r.y()).normalized();
}

bool PlaneSpace::admissible(const SlantedPlane& plane, int x, int y) const {
  const Range& range = ranges_[index(x, y)];
  if (!(plane.inverse >= range.least && plane.inverse <= range.most)) return false;
  const Vector3f r = ray(x, y);
  return -normal_of(plane, x, y).dot(r) > 0.17F * r.norm();
}

SlantedPlane PlaneSpace::random_plane(int x, int y, PixelRandom& random) const {
  const Range& range = ranges_[index(x, y)];
  const float inverse = range.least + random.uniform() * (range.most - range.least);
  return plane_from(x, y, inverse, tilted(-ray(x, y).normalized(), 1.0F, random));
}

Eigen::Vector3d PlaneSpace::world_point(int x, int y, float inverse) const {
  return world_from_cam_ * (ray(x, y) / inverse).cast<double>();
}

double PlaneSpace::up(const SlantedPlane& plane, int x, int y) const {
  return static_cast<double>(up_.dot(normal_of(plane, x, y)));
}

Vector3f tilted(const Vector3f& direction, float amount, PixelRandom& random) {
  const float a = random.symmetric();
  const float b = random.symmetric();
  const float c = random.symmetric();
  return (direction + amount * Vector3f(a, b, c)).normalized();
}

}  // namespace gyre
