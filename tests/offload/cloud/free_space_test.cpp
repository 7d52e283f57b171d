// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/free_space.h"

#include "ray_scene.h"

#include <gtest/gtest.h>
#include <cmath>

namespace gyre {
namespace {

TEST(FreeSpace, SurfaceStaysAndWhatFloatsInFrontOfItGoes) {
  const test::RayScene scene;
  const std::vector<StereoView> views = test::views_on_arc(scene, 4, 20.0, 64);
  std::vector<StereoDepth> maps;
  for (const StereoView& view : views) maps.push_back(test::true_depth(scene, view));
  PointCloud cloud;
  const Eigen::Vector3d front = Eigen::Vector3d(0, 0.1, 1).normalized();
  for (const double radius : {scene.radius, scene.radius + 0.05}) {
    cloud.points.emplace_back((scene.centre + radius * front).cast<float>());
    cloud.normals.emplace_back(front.cast<float>());
  }
  // Beside the sphere: the views see the room behind it.
  cloud.points.emplace_back((scene.centre + 1.15 * scene.radius * Eigen::Vector3d::UnitX()).cast<float>());
  cloud.normals.emplace_back(0, 0, 1);
  EXPECT_EQ(outside_free_space(cloud, views, maps, {}, 2), (std::vector<char>{1, 0, 0}));
}

TEST(FreeSpace, ThePointsOfASurfaceKnowTheirViews) {
  const test::RayScene scene;
  const std::vector<StereoView> views = test::views_on_arc(scene, 4, 40.0, 320);  // at -60, -20, 20 and 60 degrees
  std::vector<StereoDepth> maps;
  for (const StereoView& view : views) maps.push_back(test::true_depth(scene, view));
  PointCloud cloud;
  for (const double azimuth : {-60.0, 0.0, 60.0}) {
    const double a = azimuth * 0.017453292519943295;
    const Eigen::Vector3d normal(std::sin(a), 0, std::cos(a));
    cloud.points.emplace_back((scene.centre + scene.radius * normal).cast<float>());
    cloud.normals.emplace_back(normal.cast<float>());
  }
  // A view 80 degrees off looks too flatly.
  const PointViews seen = views_that_see(cloud, views, maps, {}, 2);
  const auto of = [&](std::size_t i) { return std::vector<int>(seen.of(i).begin(), seen.of(i).end()); };
  EXPECT_EQ(of(0), (std::vector<int>{0, 1}));
  EXPECT_EQ(of(1), (std::vector<int>{0, 1, 2, 3}));
  EXPECT_EQ(of(2), (std::vector<int>{2, 3}));
}

TEST(FreeSpace, NobodyLooksThroughTheInsideOfASolid) {
  const test::RayScene scene;
  const std::vector<StereoView> views = test::views_on_arc(scene, 4, 20.0, 64);
  std::vector<StereoDepth> maps;
  for (const StereoView& view : views) maps.push_back(test::true_depth(scene, view));
  const SightCount inside = count_sight(scene.centre, views, maps, {});
  EXPECT_EQ(inside.through, 0);
  EXPECT_EQ(inside.blocked, 4);
  const SightCount beside = count_sight(scene.centre + 1.2 * scene.radius * Eigen::Vector3d::UnitY(), views, maps, {});
  EXPECT_EQ(beside.through, 4);
  EXPECT_EQ(beside.blocked, 0);
}

}  // namespace
}  // namespace gyre
