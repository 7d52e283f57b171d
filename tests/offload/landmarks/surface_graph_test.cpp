// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/surface_graph.h"

#include "offload/landmarks/point_grid.h"

#include <gtest/gtest.h>
#include <random>

namespace gyre {
namespace {

// A strip 0.1 m wide along x from `from` to `to`.
void add_strip(PointCloud& cloud, double from, double to) {
  for (double x = from; x < to; x += 0.004)
    for (double z = 0; z < 0.1; z += 0.004) {
      cloud.points.emplace_back(static_cast<float>(x), 0.0F, static_cast<float>(z));
      cloud.normals.emplace_back(0.0F, 1.0F, 0.0F);
    }
}

int node_near(const SurfaceGraph& graph, double x) {
  int best = 0;
  for (std::size_t i = 0; i < graph.size(); ++i)
    if (std::abs(graph.nodes[i].x() - x) < std::abs(graph.nodes[best].x() - x)) best = static_cast<int>(i);
  return best;
}

TEST(SurfaceGraph, DistancesFollowTheSurface) {
  PointCloud cloud;
  add_strip(cloud, 0, 1);
  const SurfaceGraph graph = make_surface_graph(cloud);
  const int source[] = {node_near(graph, 0)};
  const std::vector<double> distance = geodesic_distances(graph, source, 2);
  EXPECT_NEAR(distance[node_near(graph, 0.99)], 0.99, 0.12);
}

TEST(SurfaceGraph, GapsAreBridgedOnceAndStrayPointsLeftOut) {
  PointCloud cloud;
  add_strip(cloud, 0, 0.4);
  add_strip(cloud, 0.5, 1);
  cloud.points.emplace_back(0.45F, 0.3F, 0.05F);
  cloud.normals.emplace_back(0.0F, 1.0F, 0.0F);
  const SurfaceGraph graph = make_surface_graph(cloud);
  for (const Eigen::Vector3d& p : graph.nodes) EXPECT_LT(p.y(), 0.1);
  const int source[] = {node_near(graph, 0)};
  EXPECT_NEAR(geodesic_distances(graph, source, 2)[node_near(graph, 0.99)], 1.0, 0.2);
  // A gap wider than any bridge stays.
  PointCloud apart;
  add_strip(apart, 0, 0.4);
  add_strip(apart, 0.8, 1.2);
  const SurfaceGraph two = make_surface_graph(apart);
  const int from[] = {node_near(two, 0)};
  EXPECT_TRUE(std::isinf(geodesic_distances(two, from, 5)[node_near(two, 1.19)]));
}

TEST(PointGrid, FindsWhatBruteForceFinds) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 2000; ++i) points.emplace_back(uniform(random), uniform(random), uniform(random));
  const PointGrid grid(points, 0.07);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d place(uniform(random), uniform(random), uniform(random));
    std::size_t found = 0, wanted = 0;
    grid.for_within(place, 0.2, [&](std::uint32_t, double) { ++found; });
    int nearest = -1;
    for (std::size_t k = 0; k < points.size(); ++k) {
      wanted += (points[k] - place).norm() <= 0.2 ? 1 : 0;
      if (nearest < 0 || (points[k] - place).norm() < (points[nearest] - place).norm()) nearest = static_cast<int>(k);
    }
    EXPECT_EQ(found, wanted);
    if ((points[nearest] - place).norm() <= 0.2) {
      EXPECT_EQ(grid.nearest(place, 0.2), nearest);
    }
  }
}

}  // namespace
}  // namespace gyre
