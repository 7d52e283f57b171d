// SPDX-License-Identifier: Apache-2.0
#include "offload/fit/fit_quality.h"

#include "offload/fit/cloud_preparation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace gyre {

namespace {

constexpr double trusted_support = 0.3;  // regions with a smaller share of supported vertices are mostly guessed
constexpr double reach = 0.1;            // metres; whatever is farther counts as that far

}  // namespace

std::string region_name(BodyRegion region) {
  switch (region) {
    case BodyRegion::torso:
      return "torso";
    case BodyRegion::head:
      return "head";
    case BodyRegion::face:
      return "face";
    case BodyRegion::left_arm:
      return "left arm";
    case BodyRegion::right_arm:
      return "right arm";
    case BodyRegion::left_hand:
      return "left hand";
    case BodyRegion::right_hand:
      return "right hand";
    case BodyRegion::left_leg:
      return "left leg";
    case BodyRegion::right_leg:
      return "right leg";
    case BodyRegion::left_foot:
      return "left foot";
    case BodyRegion::right_foot:
      return "right foot";
    case BodyRegion::inner:
      return "inner";
  }
  return "unknown";
}

FitQuality measure_quality(const BodyTemplate& body, const OuterSurface& outer, const OrientedPoints& cloud,
                           const std::vector<Eigen::Vector3d>& vertices, const std::vector<double>& support,
                           int threads) {
  FitQuality quality;
  quality.residual.assign(vertices.size(), std::numeric_limits<double>::quiet_NaN());
  quality.confidence.assign(vertices.size(), 0.0);
  const std::vector<Eigen::Vector3d> normals = vertex_normals(vertices, body.mesh.triangles);
  const SearchableSurface surface(outer, vertices, normals);

  std::vector<double> distances;
  for (const Match& m : match_cloud(cloud, surface, {reach, 0.0, 12}, threads))
    distances.push_back((place_of(m, vertices) - m.target).norm());
  distances.resize(cloud.size(), reach);
  std::sort(distances.begin(), distances.end());
  quality.residual_mean =
      std::accumulate(distances.begin(), distances.end(), 0.0) / static_cast<double>(distances.size());
  quality.residual_p95 = distances[static_cast<std::size_t>(0.95 * static_cast<double>(distances.size() - 1))];

  constexpr double beside = 0.015;  // metres along the surface
  const PointIndex index(thin(cloud, cell_for_count(cloud, 2 * outer.vertices.size())));
  for (const Match& m : match_vertices(outer.vertices, surface, index, {reach, 0.5, 8}, beside, threads)) {
    const int v = m.corners[0];
    const double residual = (vertices[v] - m.target).norm();
    constexpr double large = 0.01;  // metres
    quality.residual[v] = residual;
    quality.confidence[v] = support[v] * large * large / (large * large + residual * residual);
  }

  std::map<std::string, std::pair<int, int>> counts;
  for (const int v : outer.vertices) {
    auto& [held, all] = counts[region_name(body.regions[v])];
    held += support[v] > 0 ? 1 : 0;
    ++all;
  }
  for (const auto& [name, count] : counts) {
    quality.support[name] = static_cast<double>(count.first) / count.second;
    if (quality.support[name] < trusted_support) quality.prior_only.push_back(name);
  }
  return quality;
}

}  // namespace gyre
