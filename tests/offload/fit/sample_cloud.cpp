// SPDX-License-Identifier: Apache-2.0
#include "tests/offload/fit/sample_cloud.h"

#include "common/geometry/camera.h"
#include "common/geometry/pose.h"
#include "common/render/rasterise.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

namespace gyre {

PointCloud sample_visible(std::span<const Eigen::Vector3d> vertices, std::span<const Eigen::Vector3i> triangles,
                          const SampleOptions& options) {
  struct Seen {
    std::int32_t triangle;
    Eigen::Vector2f weights;
  };
  std::vector<Seen> seen;
  const Camera camera = Camera::from_fov(options.image_height * 3 / 4, options.image_height, 0.9);
  for (const double height : {0.5, 1.9}) {
    for (int i = 0; i < 10; ++i) {
      const double angle = 2 * std::numbers::pi * i / 10;
      const Eigen::Vector3d eye(2.4 * std::sin(angle), height, 2.4 * std::cos(angle));
      const VisibilityBuffer view = rasterise(vertices, triangles, camera, look_at(eye, {0, 0.85, 0}));
      for (std::size_t p = 0; p < view.triangle.size(); ++p)
        if (view.triangle[p] >= 0) seen.push_back({view.triangle[p], view.weights[p]});
    }
  }
  std::mt19937_64 random(options.seed);
  std::normal_distribution<double> noise(0.0, options.noise);
  PointCloud cloud;
  for (int i = 0; i < options.points && !seen.empty(); ++i) {
    const Seen& s = seen[random() % seen.size()];
    const Eigen::Vector3i& t = triangles[s.triangle];
    const Eigen::Vector3d ab = vertices[t[1]] - vertices[t[0]], ac = vertices[t[2]] - vertices[t[0]];
    const Eigen::Vector3d normal = ab.cross(ac);
    if (!(normal.norm() > 0)) continue;
    const Eigen::Vector3d p = vertices[t[0]] + s.weights[0] * ab + s.weights[1] * ac +
                              Eigen::Vector3d(noise(random), noise(random), noise(random));
    cloud.points.push_back(p.cast<float>());
    cloud.normals.push_back(normal.normalized().cast<float>());
  }
  return cloud;
}

std::vector<Eigen::Vector3d> visible_points(std::span<const Eigen::Vector3d> vertices,
                                            std::span<const Eigen::Vector3i> triangles, int points, int image_height) {
  std::vector<Eigen::Vector3d> seen;
  for (const Eigen::Vector3f& p : sample_visible(vertices, triangles, {points, 0.0, image_height, 7}).points)
    seen.push_back(p.cast<double>());
  return seen;
}

PointCloud moved(const PointCloud& cloud, double yaw, const Eigen::Vector3d& shift) {
  const Eigen::Matrix3f turn = Eigen::AngleAxisf(static_cast<float>(yaw), Eigen::Vector3f::UnitY()).toRotationMatrix();
  PointCloud result = cloud;
  for (Eigen::Vector3f& p : result.points) p = turn * p + shift.cast<float>();
  for (Eigen::Vector3f& n : result.normals) n = turn * n;
  return result;
}

}  // namespace gyre
