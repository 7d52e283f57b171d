// SPDX-License-Identifier: Apache-2.0
// A cloud as a graph of neighbouring places, for distances along the surface.
#pragma once

#include "common/mesh/mesh.h"

#include <Eigen/Core>
#include <span>
#include <utility>
#include <vector>

namespace gyre {

struct SurfaceGraphOptions {
  double spacing = 0.008;         // metres between nodes
  double bridge = 0.18;           // longest gap that a connection may cross, metres
  double smallest_share = 0.002;  // parts with fewer of the nodes are outliers
};

struct SurfaceGraph {
  std::vector<Eigen::Vector3d> nodes;                      // means of the cloud's points in cubes
  std::vector<Eigen::Vector3d> normals;                    // likewise, unit (zero where the points disagree)
  std::vector<std::vector<std::pair<int, double>>> edges;  // of each node: neighbour, length

  std::size_t size() const { return nodes.size(); }
};

// Nodes nearer than 2.3 spacings are joined. Parts the cloud's holes have torn off are tied to the rest by the shortest
// gaps (Kruskal's minimum spanning tree over the parts); what is smaller than the share is left out.
SurfaceGraph make_surface_graph(const PointCloud& cloud, const SurfaceGraphOptions& options = {});

// Length of the shortest way from any of the sources (Dijkstra); infinity: none, or longer than `limit`.
std::vector<double> geodesic_distances(const SurfaceGraph& graph, std::span<const int> sources, double limit);

}  // namespace gyre
