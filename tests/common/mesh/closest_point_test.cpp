// SPDX-License-Identifier: Apache-2.0
#include "common/mesh/closest_point.h"

#include "common/mesh/mesh.h"

#include <gtest/gtest.h>
#include <random>
#include <vector>

namespace gyre {
namespace {

// A square of side 2 in the plane z = 0 facing +Z, and its copy at z = -1.
TriangleMesh two_squares() {
  TriangleMesh mesh;
  for (const double z : {0.0, -1.0}) {
    const int first = static_cast<int>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), {{-1, -1, z}, {1, -1, z}, {1, 1, z}, {-1, 1, z}});
    mesh.triangles.emplace_back(first, first + 1, first + 2);
    mesh.triangles.emplace_back(first, first + 2, first + 3);
  }
  return mesh;
}

TEST(closest_point, faces_edges_and_corners_of_a_square) {
  const ClosestPoint surface(two_squares());
  const auto face = surface.nearest({0.3, -0.4, 0.2});
  ASSERT_TRUE(face);
  EXPECT_NEAR((face->position - Eigen::Vector3d(0.3, -0.4, 0)).norm(), 0, 1e-12);
  EXPECT_NEAR(face->distance, 0.2, 1e-12);
  EXPECT_NEAR((face->normal - Eigen::Vector3d(0, 0, 1)).norm(), 0, 1e-12);
  const auto edge = surface.nearest({2, 0.5, 0});
  ASSERT_TRUE(edge);
  EXPECT_NEAR((edge->position - Eigen::Vector3d(1, 0.5, 0)).norm(), 0, 1e-12);
  const auto corner = surface.nearest({4, 5, 0});
  ASSERT_TRUE(corner);
  EXPECT_NEAR(corner->distance, 5, 1e-12);
}

TEST(closest_point, weights_rebuild_the_position) {
  const TriangleMesh mesh = two_squares();
  const auto found = ClosestPoint(mesh).nearest({0.25, 0.5, 3});
  ASSERT_TRUE(found);
  const Eigen::Vector3i& t = mesh.triangles[found->triangle];
  const Eigen::Vector2d& w = found->weights;
  const Eigen::Vector3d rebuilt =
      (1 - w.sum()) * mesh.vertices[t[0]] + w[0] * mesh.vertices[t[1]] + w[1] * mesh.vertices[t[2]];
  EXPECT_NEAR((rebuilt - found->position).norm(), 0, 1e-12);
}

TEST(closest_point, nothing_beyond_the_radius_or_on_an_empty_mesh) {
  const ClosestPoint surface(two_squares());
  EXPECT_FALSE(surface.nearest({0, 0, 0.5}, 0.4));
  EXPECT_TRUE(surface.nearest({0, 0, 0.5}, 0.6));
  EXPECT_FALSE(ClosestPoint(TriangleMesh()).nearest({0, 0, 0}));
}

TEST(closest_point, agrees_with_trying_every_triangle) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  TriangleMesh mesh;
  for (int i = 0; i < 300; ++i) mesh.vertices.emplace_back(uniform(random), uniform(random), uniform(random));
  for (int i = 0; i + 2 < 300; i += 3) mesh.triangles.emplace_back(i, i + 1, i + 2);
  const ClosestPoint all(mesh);
  std::vector<ClosestPoint> singles;
  for (const Eigen::Vector3i& t : mesh.triangles) singles.emplace_back(mesh.vertices, std::span(&t, 1));
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d query(2 * uniform(random), 2 * uniform(random), 2 * uniform(random));
    double best = std::numeric_limits<double>::infinity();
    for (const ClosestPoint& single : singles) best = std::min(best, single.nearest(query)->distance);
    EXPECT_NEAR(all.nearest(query)->distance, best, 1e-12);
  }
}

TEST(closest_point, rays_hit_the_first_surface_and_see_what_lies_between) {
  const ClosestPoint surface(two_squares());
  const auto hit = surface.first_hit({0.1, 0.2, 5}, {0, 0, -2});
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->distance, 2.5, 1e-6);
  EXPECT_NEAR((hit->position - Eigen::Vector3d(0.1, 0.2, 0)).norm(), 0, 1e-6);
  EXPECT_FALSE(surface.first_hit({3, 0, 5}, {0, 0, -1}));
  EXPECT_TRUE(surface.occluded({0, 0, 1}, {0, 0, -0.5}, 0.01));
  EXPECT_FALSE(surface.occluded({0, 0, 1}, {0, 0, 0}, 0.01));
  EXPECT_FALSE(surface.occluded({3, 0, 1}, {3, 0, -2}, 0.01));
}

}  // namespace
}  // namespace gyre
