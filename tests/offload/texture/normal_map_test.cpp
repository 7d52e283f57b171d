// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/normal_map.h"

#include "common/mesh/tangents.h"
#include "offload/texture/atlas.h"
#include "tests/offload/texture/scene.h"

#include <gtest/gtest.h>
#include <cmath>

namespace gyre {
namespace {

constexpr double radius = 0.25;
constexpr double height = 0.002;  // of the bumps, metres
constexpr double waves = 80.0;    // radians a metre

// How far the bumpy ball stands out in a direction, and zero on its surface.
double bump(const Eigen::Vector3d& direction) {
  const Eigen::Vector3d p = waves * radius * direction;
  return height * std::sin(p.x()) * std::sin(p.y()) * std::sin(p.z());
}
double level(const Eigen::Vector3d& p) {
  return p.norm() - radius - bump(p.normalized());
}

Eigen::Vector3d bumpy_normal(const Eigen::Vector3d& p) {
  constexpr double step = 1e-6;
  Eigen::Vector3d gradient;
  for (int k = 0; k < 3; ++k)
    gradient[k] = level(p + step * Eigen::Vector3d::Unit(k)) - level(p - step * Eigen::Vector3d::Unit(k));
  return gradient.normalized();
}

// Points on the front half (z > 0) of the bumpy ball, evenly spread.
PointCloud bumpy_cloud() {
  PointCloud cloud;
  constexpr int count = 120000;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (i + 0.5) / count;
    const double around = i * 2.399963229728653;  // the golden angle
    const double r = std::sqrt(1 - z * z);
    const Eigen::Vector3d direction(r * std::cos(around), r * std::sin(around), z);
    const Eigen::Vector3d p = (radius + bump(direction)) * direction;
    cloud.points.emplace_back(p.cast<float>());
    cloud.normals.emplace_back(bumpy_normal(p).cast<float>());
    cloud.deviation.push_back(0.0002F);
  }
  return cloud;
}

TEST(NormalMap, HoldsTheReliefThatTheMeshLacks) {
  TriangleMesh ball;
  scene::add_ball(ball, radius, 24);
  const PointCloud cloud = bumpy_cloud();
  NormalMapOptions options;
  options.size = 512;
  const std::vector<std::uint8_t> skip(ball.triangles.size(), 0);
  const NormalMap map = bake_normal_map(ball, cloud, skip, options, 2);
  EXPECT_NEAR(map.covered, 0.5, 0.05);

  const auto normals = vertex_normals(ball.vertices, ball.triangles);
  const auto tangents = corner_tangents(ball, normals);
  const Atlas atlas = map_atlas(ball.uv, ball.uv_triangles, options.size, 0);
  double flat_error = 0, error = 0;
  int count = 0;
  for (std::size_t i = 0; i < atlas.texels(); ++i) {
    const int t = atlas.triangle[i];
    if (t < 0) continue;
    const Eigen::Vector3d direction = texel_point(ball, atlas, i).normalized();
    const cv::Vec3b c = map.picture.at<cv::Vec3b>(static_cast<int>(i) / atlas.size, static_cast<int>(i) % atlas.size);
    if (direction.z() < -0.05) {
      EXPECT_EQ(c, cv::Vec3b(255, 128, 128));
      continue;
    }
    if (direction.z() < 0.05) continue;
    // As a renderer reads it.
    const Eigen::Vector3d w = corner_weights(atlas, i);
    Eigen::Vector3d n = Eigen::Vector3d::Zero(), along = Eigen::Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      n += w[k] * normals[ball.triangles[t][k]];
      along += w[k] * tangents[t][static_cast<std::size_t>(k)].head<3>().cast<double>();
    }
    n.normalize();
    along = (along - n.dot(along) * n).normalized();
    const Eigen::Vector3d up = double{tangents[t][0][3]} * n.cross(along);
    const auto number = [](std::uint8_t byte) { return byte / 127.5 - 1.0; };
    const Eigen::Vector3d shown = (number(c[2]) * along + number(c[1]) * up + number(c[0]) * n).normalized();
    const Eigen::Vector3d truth = bumpy_normal((radius + bump(direction)) * direction);
    const auto degrees = [&](const Eigen::Vector3d& v) {
      return std::acos(std::clamp(v.dot(truth), -1.0, 1.0)) * 180.0 / M_PI;
    };
    flat_error += degrees(n);
    error += degrees(shown);
    ++count;
  }
  ASSERT_GT(count, 1000);
  EXPECT_GT(flat_error / count, 3.0);
  EXPECT_LT(error / count, 0.25 * flat_error / count);
}

TEST(NormalMap, StaysFlatWithoutPointsOrWhereItIsToldTo) {
  TriangleMesh ball;
  scene::add_ball(ball, radius, 8);
  NormalMapOptions options;
  options.size = 128;
  const cv::Mat flat(128, 128, CV_8UC3, cv::Scalar(255, 128, 128));
  const NormalMap without =
      bake_normal_map(ball, PointCloud(), std::vector<std::uint8_t>(ball.triangles.size(), 0), options, 2);
  EXPECT_EQ(cv::norm(without.picture, flat, cv::NORM_INF), 0.0);
  EXPECT_EQ(without.covered, 0.0);
  const NormalMap skipped =
      bake_normal_map(ball, bumpy_cloud(), std::vector<std::uint8_t>(ball.triangles.size(), 1), options, 2);
  EXPECT_EQ(cv::norm(skipped.picture, flat, cv::NORM_INF), 0.0);
}

}  // namespace
}  // namespace gyre
