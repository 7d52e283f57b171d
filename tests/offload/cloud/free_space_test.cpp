// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/free_space.h"

#include "ray_scene.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace gyre
