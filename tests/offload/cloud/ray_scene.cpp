// SPDX-License-Identifier: Apache-2.0
#include "ray_scene.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <opencv2/core.hpp>

namespace gyre::test {
namespace {

double lattice(std::int64_t x, std::int64_t y, std::int64_t z) {
  auto h = static_cast<std::uint64_t>(x * 73856093 ^ y * 19349663 ^ z * 83492791);
  h = (h ^ (h >> 30U)) * 0xBF58476D1CE4E5B9U;
  h = (h ^ (h >> 27U)) * 0x94D049BB133111EBU;
  return static_cast<double>((h ^ (h >> 31U)) >> 40U) / 16777216.0;
}

// Value noise in [0, 1] with one lattice cell a unit.
double noise(const Eigen::Vector3d& x) {
  const Eigen::Vector3d base = x.array().floor();
  const Eigen::Vector3d f = x - base;
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3i d(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
    double weight = 1;
    for (int axis = 0; axis < 3; ++axis) weight *= d[axis] != 0 ? f[axis] : 1 - f[axis];
    sum += weight * lattice(static_cast<std::int64_t>(base[0]) + d[0], static_cast<std::int64_t>(base[1]) + d[1],
                            static_cast<std::int64_t>(base[2]) + d[2]);
  }
  return sum;
}

Pose look_at_point(const Eigen::Vector3d& eye, const Eigen::Vector3d& target) {
  const Eigen::Vector3d forward = (target - eye).normalized();
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitY()).normalized();
  Eigen::Matrix3d rotation;
  rotation.row(0) = right;
  rotation.row(1) = forward.cross(right);
  rotation.row(2) = forward;
  return {Eigen::Quaterniond(rotation), -(rotation * eye)};
}

}  // namespace

RayScene::Hit RayScene::cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const {
  const Eigen::Vector3d from = origin - centre;
  const double a = direction.squaredNorm();
  const double b = from.dot(direction);
  const double discriminant = b * b - a * (from.squaredNorm() - radius * radius);
  if (discriminant > 0 && -b - std::sqrt(discriminant) > 0) return {(-b - std::sqrt(discriminant)) / a, true};
  if (direction.y() < -1e-3 && -origin.y() / direction.y() < 4.0) return {-origin.y() / direction.y(), false};
  return {4.0, false};
}

cv::Mat RayScene::picture(const Camera& camera, const Pose& cam_from_world) const {
  const Pose world_from_cam = cam_from_world.inverse();
  cv::Mat picture(camera.height, camera.width, CV_8UC3);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      Eigen::Vector3d colour = Eigen::Vector3d::Zero();
      for (int tap = 0; tap < 4; ++tap) {
        const Eigen::Vector2d xy =
            camera.normalised_from_pixel({x + 0.25 + 0.5 * (tap & 1), y + 0.25 + 0.5 * (tap / 2)});
        const Eigen::Vector3d direction = world_from_cam.rotation * Eigen::Vector3d(xy.x(), xy.y(), 1.0);
        const Hit hit = cast(world_from_cam.translation, direction);
        const Eigen::Vector3d p = world_from_cam.translation + hit.t * direction;
        const double value = 0.5 * noise(p * 40.0) + 0.5 * noise(p * 90.0);
        colour +=
            (hit.sphere ? Eigen::Vector3d(230, 120, 60) : Eigen::Vector3d(60, 110, 190)) * (0.15 + 0.85 * value) / 4;
      }
      for (int c = 0; c < 3; ++c) {
        picture.at<cv::Vec3b>(y, x)[c] = static_cast<std::uint8_t>(std::clamp(colour[c] + 0.5, 0.0, 255.0));
      }
    }
  }
  return picture;
}

SubjectRegion RayScene::region() const {
  const double half = radius + 0.06;
  return {Eigen::Vector3d(centre.x() - half, -0.02, centre.z() - half),
          Eigen::Vector3d(centre.x() + half, centre.y() + half, centre.z() + half)};
}

Camera test_camera(int width) {
  Camera camera;
  camera.width = width;
  camera.height = width * 5 / 4;
  camera.fx = camera.fy = 1.3 * width;
  camera.cx = 0.5 * camera.width;
  camera.cy = 0.5 * camera.height;
  return camera;
}

std::vector<Pose> arc(const RayScene& scene, int count, double step_deg) {
  std::vector<Pose> poses;
  for (int i = 0; i < count; ++i) {
    const double angle = (i - 0.5 * (count - 1)) * step_deg * std::numbers::pi / 180.0;
    const Eigen::Vector3d eye = scene.centre + Eigen::Vector3d(1.2 * std::sin(angle), 0.15, 1.2 * std::cos(angle));
    poses.push_back(look_at_point(eye, scene.centre));
  }
  return poses;
}

std::vector<StereoView> views_on_arc(const RayScene& scene, int count, double step_deg, int width) {
  const Camera camera = test_camera(width);
  std::vector<StereoView> views;
  for (const Pose& pose : arc(scene, count, step_deg)) {
    views.push_back(make_stereo_view("view", scene.picture(camera, pose), camera, pose, camera.height, 2));
  }
  return views;
}

StereoDepth true_depth(const RayScene& scene, const StereoView& view) {
  const std::size_t size = static_cast<std::size_t>(view.width()) * view.height();
  StereoDepth map{view.width(), view.height(), {}, {}, {}, {}};
  map.state.assign(size, PixelState::beyond);
  map.depth.assign(size, 0.0F);
  map.normal.assign(size, Eigen::Vector3f::Zero());
  map.cost.assign(size, 0.1F);
  const Pose world_from_cam = view.cam_from_world.inverse();
  const Eigen::Matrix3d inverse = view.levels[0].index_from_camera.inverse();
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      const Eigen::Vector3d direction = world_from_cam.rotation * (inverse * Eigen::Vector3d(x, y, 1.0));
      const RayScene::Hit hit = scene.cast(world_from_cam.translation, direction);
      const std::size_t i = map.index(x, y);
      map.depth[i] = static_cast<float>(hit.t);
      if (!hit.sphere) continue;
      const Eigen::Vector3d outward = (world_from_cam.translation + hit.t * direction - scene.centre) / scene.radius;
      map.state[i] = PixelState::surface;
      map.normal[i] = (view.cam_from_world.rotation * outward).cast<float>();
    }
  }
  return map;
}

}  // namespace gyre::test
