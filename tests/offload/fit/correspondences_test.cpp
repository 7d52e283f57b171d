// SPDX-License-Identifier: Apache-2.0
// Counterparts between a surface and a cloud: distance, normals, holes.
#include "offload/fit/correspondences.h"

#include "common/mesh/mesh.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

// A flat square of 21 x 21 vertices over [0, 1]^2 facing +Z.
struct Square {
  Square() {
    constexpr int n = 21;
    for (int i = 0; i < n; ++i)
      for (int k = 0; k < n; ++k) {
        outer.vertices.push_back(static_cast<int>(vertices.size()));
        vertices.emplace_back(i / 20.0, k / 20.0, 0);
      }
    outer.vertex_triangles.resize(vertices.size());
    for (int i = 0; i + 1 < n; ++i)
      for (int k = 0; k + 1 < n; ++k) {
        const int a = i * n + k, b = a + n, c = b + 1, d = a + 1;
        outer.triangles.emplace_back(a, b, c);
        outer.triangles.emplace_back(a, c, d);
      }
    for (std::size_t t = 0; t < outer.triangles.size(); ++t)
      for (int k = 0; k < 3; ++k) outer.vertex_triangles[outer.triangles[t][k]].push_back(static_cast<int>(t));
    normals = vertex_normals(vertices, outer.triangles);
  }
  OuterSurface outer;
  std::vector<Eigen::Vector3d> vertices, normals;
};

TEST(MatchCloud, FindsThePointOnTheTriangle) {
  const Square square;
  const SearchableSurface surface(square.outer, square.vertices, square.normals);
  const OrientedPoints cloud{{{0.512, 0.333, 0.03}}, {Eigen::Vector3d::UnitZ()}};
  const auto matches = match_cloud(cloud, surface, {0.1, 0.5, 8}, 1);
  ASSERT_EQ(matches.size(), 1U);
  Eigen::Vector3d x = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) x += matches[0].weights[k] * square.vertices[matches[0].corners[k]];
  EXPECT_LT((x - Eigen::Vector3d(0.512, 0.333, 0)).norm(), 1e-12);
  EXPECT_NEAR(matches[0].offset, 0.03, 1e-12);
  EXPECT_NEAR(matches[0].weights.sum(), 1.0, 1e-12);
}

TEST(MatchCloud, RefusesDistanceAndOpposedNormals) {
  const Square square;
  const SearchableSurface surface(square.outer, square.vertices, square.normals);
  const OrientedPoints cloud{{{0.5, 0.5, 0.2}, {0.5, 0.5, 0.01}},
                             {Eigen::Vector3d::UnitZ(), -Eigen::Vector3d::UnitZ()}};
  EXPECT_TRUE(match_cloud(cloud, surface, {0.1, 0.5, 8}, 1).empty());
}

TEST(MatchVertices, TakesTheCompatibleSideOfAThinThing) {
  const Square square;
  const SearchableSurface surface(square.outer, square.vertices, square.normals);
  OrientedPoints cloud;
  for (int i = 0; i <= 40; ++i)
    for (int k = 0; k <= 40; ++k) {
      cloud.positions.emplace_back(i / 40.0, k / 40.0, 0.02);
      cloud.normals.emplace_back(Eigen::Vector3d::UnitZ());
      cloud.positions.emplace_back(i / 40.0, k / 40.0, 0.01);
      cloud.normals.emplace_back(-Eigen::Vector3d::UnitZ());
    }
  const PointIndex index(cloud);
  const auto matches = match_vertices(square.outer.vertices, surface, index, {0.1, 0.5, 12}, 0.02, 1);
  ASSERT_EQ(matches.size(), square.vertices.size());
  for (const Match& m : matches) EXPECT_NEAR(m.target.z(), 0.02, 1e-12);
}

TEST(MatchVertices, HasNothingForVerticesOverAHole) {
  const Square square;
  const SearchableSurface surface(square.outer, square.vertices, square.normals);
  OrientedPoints cloud;
  for (int i = 0; i <= 80; ++i)
    for (int k = 0; k <= 80; ++k) {
      if (i > 40) continue;
      cloud.positions.emplace_back(i / 80.0, k / 80.0, 0.0);
      cloud.normals.emplace_back(Eigen::Vector3d::UnitZ());
    }
  const PointIndex index(cloud);
  for (const Match& m : match_vertices(square.outer.vertices, surface, index, {0.5, 0.5, 8}, 0.02, 1))
    EXPECT_LE(square.vertices[m.corners[0]].x(), 0.52);
}

TEST(PointIndex, AgreesWithSearchingThemAll) {
  OrientedPoints points;
  for (int i = 0; i < 500; ++i) {
    const auto component = [&](int factor) { return static_cast<double>(i * factor % 997) / 997; };
    points.positions.emplace_back(component(389), component(577), component(811));
    points.normals.emplace_back(Eigen::Vector3d::UnitX());
  }
  const PointIndex index(points);
  for (int q = 0; q < 20; ++q) {
    const Eigen::Vector3d query(0.05 * q, 0.5, 1 - 0.04 * q);
    double least = 1e9;
    for (const Eigen::Vector3d& p : points.positions) least = std::min(least, (p - query).norm());
    EXPECT_NEAR(index.nearest(query, 3).front().distance, least, 1e-6);
  }
}

}  // namespace
}  // namespace gyre
