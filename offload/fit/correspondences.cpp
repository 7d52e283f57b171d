// SPDX-License-Identifier: Apache-2.0
#include "offload/fit/correspondences.h"

#include "common/mesh/closest_point.h"
#include "common/mesh/triangle.h"
#include "common/parallel/parallel.h"

#include <Eigen/Geometry>
#include <cmath>
#include <optional>

namespace gyre {

namespace {

constexpr std::size_t queries_per_task = 256;  // the result does not depend on it

// Runs `match(i)` for every i and keeps what it found, in order.
template <class F>
std::vector<Match> collect(std::size_t count, int threads, const F& match) {
  std::vector<std::optional<Match>> found(count);
  parallel_for((count + queries_per_task - 1) / queries_per_task, threads, [&](std::size_t b) {
    for (std::size_t i = b * queries_per_task; i < std::min(count, (b + 1) * queries_per_task); ++i)
      found[i] = match(i);
  });
  std::vector<Match> matches;
  matches.reserve(count);
  for (const std::optional<Match>& m : found)
    if (m) matches.push_back(*m);
  return matches;
}

OrientedPoints outer_points(const OuterSurface& outer, std::span<const Eigen::Vector3d> vertices,
                            std::span<const Eigen::Vector3d> normals) {
  OrientedPoints points;
  points.positions.reserve(outer.vertices.size());
  points.normals.reserve(outer.vertices.size());
  for (const int v : outer.vertices) {
    points.positions.push_back(vertices[v]);
    points.normals.push_back(normals[v]);
  }
  return points;
}

// Whether light gets to a vertex of the rest pose: some of the rays spread about its normal leave the template. Insides
// of lips, lids, nostrils and ears, and what lies between fingers or toes, never show, and a match there is a mistake.
std::vector<bool> exposed(const BodyTemplate& body, int vertex_count) {
  constexpr int rays = 16;
  constexpr double near = 2e-4, far = 0.05;  // metres; what is farther leaves room for a view
  constexpr double least = 0.3;              // share of the rays
  const ClosestPoint mesh(body.mesh);
  const std::vector<Eigen::Vector3d> normals = vertex_normals(body.mesh.vertices, body.mesh.triangles);
  std::vector<bool> open(body.mesh.vertices.size(), false);
  for (int v = 0; v < vertex_count; ++v) {
    const Eigen::Vector3d& n = normals[v];
    if (!(n.norm() > 0)) continue;
    const Eigen::Vector3d side = n.unitOrthogonal(), other = n.cross(side);
    int free = 0;
    for (int i = 0; i < rays; ++i) {
      // Cosine-weighted, by a golden spiral over the disc below the hemisphere.
      const double radius = std::sqrt((i + 0.5) / rays), angle = 2.399963 * i;
      const Eigen::Vector3d direction =
          radius * std::cos(angle) * side + radius * std::sin(angle) * other + std::sqrt(1.0 - radius * radius) * n;
      const auto hit = mesh.first_hit(body.mesh.vertices[v], direction, near);
      if (!hit || hit->distance > far) ++free;
    }
    open[v] = free >= least * rays;
  }
  return open;
}

}  // namespace

OuterSurface outer_surface(const BodyTemplate& body) {
  OuterSurface outer;
  const TemplatePart* part = body.part("body");
  const int vertex_count = part ? part->vertex_count : static_cast<int>(body.mesh.vertices.size());
  const int triangle_count = part ? part->triangle_count : static_cast<int>(body.mesh.triangles.size());
  const std::vector<bool> open = exposed(body, vertex_count);
  const auto inner = [&](int v) { return body.regions[v] == BodyRegion::inner || !open[v]; };
  for (int v = 0; v < vertex_count; ++v)
    if (!inner(v)) outer.vertices.push_back(v);
  outer.vertex_triangles.resize(body.mesh.vertices.size());
  for (int t = 0; t < triangle_count; ++t) {
    const Eigen::Vector3i& corners = body.mesh.triangles[t];
    if (inner(corners[0]) || inner(corners[1]) || inner(corners[2])) continue;
    for (int k = 0; k < 3; ++k) outer.vertex_triangles[corners[k]].push_back(static_cast<int>(outer.triangles.size()));
    outer.triangles.push_back(corners);
  }
  return outer;
}

SearchableSurface::SearchableSurface(const OuterSurface& given, std::span<const Eigen::Vector3d> all_vertices,
                                     std::span<const Eigen::Vector3d> all_normals)
    : outer(&given),
      vertices(all_vertices),
      normals(all_normals),
      index(outer_points(given, all_vertices, all_normals)) {}

std::vector<Match> match_cloud(const OrientedPoints& cloud, const SearchableSurface& surface, const MatchGate& gate,
                               int threads) {
  return collect(cloud.size(), threads, [&](std::size_t i) -> std::optional<Match> {
    const Eigen::Vector3d& p = cloud.positions[i];
    const auto nearest = surface.index.nearest_compatible(p, cloud.normals[i], gate);
    if (!nearest) return std::nullopt;
    const int vertex = surface.outer->vertices[nearest->index];
    Match best;
    double squared = std::numeric_limits<double>::infinity();
    for (const int t : surface.outer->vertex_triangles[vertex]) {
      const Eigen::Vector3i& c = surface.outer->triangles[t];
      const Eigen::Vector3d &v0 = surface.vertices[c[0]], &v1 = surface.vertices[c[1]], &v2 = surface.vertices[c[2]];
      const Eigen::Vector3d weights = closest_weights(p, v0, v1, v2);
      const Eigen::Vector3d on_surface = weights[0] * v0 + weights[1] * v1 + weights[2] * v2;
      if (const double d = (p - on_surface).squaredNorm(); d < squared) {
        squared = d;
        best.corners = c;
        best.weights = weights;
        best.normal = (weights[0] * surface.normals[c[0]] + weights[1] * surface.normals[c[1]] +
                       weights[2] * surface.normals[c[2]]);
        best.offset = best.normal.dot(p - on_surface);
      }
    }
    const double length = best.normal.norm();
    if (!std::isfinite(squared) || !(length > 0)) return std::nullopt;
    best.normal /= length;
    best.offset /= length;
    best.target = p;
    best.weight = cloud.weight(i);
    return best;
  });
}

std::vector<Match> match_vertices(std::span<const int> vertices, const SearchableSurface& surface,
                                  const PointIndex& cloud, const MatchGate& gate, double max_slide, int threads) {
  return collect(vertices.size(), threads, [&](std::size_t i) -> std::optional<Match> {
    const int v = vertices[i];
    const Eigen::Vector3d &x = surface.vertices[v], &n = surface.normals[v];
    // The plane is averaged over the compatible neighbours near the first one: that takes the noise off.
    Eigen::Vector3d mean = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
    double first = -1.0, weight = 0.0;
    int count = 0;
    for (const Neighbour& neighbour : cloud.nearest(x, gate.candidates)) {
      if (neighbour.distance > gate.radius || (count > 0 && neighbour.distance > first + max_slide)) break;
      const Eigen::Vector3d& point_normal = cloud.points().normals[neighbour.index];
      if (point_normal.dot(n) < gate.min_cosine) continue;
      if (count == 0) first = neighbour.distance;
      const double w = cloud.points().weight(neighbour.index);
      mean += w * cloud.points().positions[neighbour.index];
      normal += w * point_normal;
      weight += w;
      ++count;
    }
    if (count == 0 || !(normal.norm() > 0)) return std::nullopt;
    mean /= weight;
    normal.normalize();
    const double along = normal.dot(mean - x);
    if ((mean - x - along * normal).norm() > max_slide) return std::nullopt;
    const Eigen::Vector3d target = x + along * normal;
    // What another part of the surface lies on already is not this vertex's: a missing arm does not fold into the
    // trunk.
    constexpr double plain = 0.02;  // metres that leave no doubt whose the points are
    constexpr double nearer = 0.4;
    if (const double distance = (target - x).norm(); distance > plain) {
      const auto owner = surface.index.nearest_compatible(target, normal, {nearer * distance, gate.min_cosine, 8});
      if (owner) return std::nullopt;
    }
    return Match{{v, v, v}, {1, 0, 0}, target, n, n.dot(target - x), weight / count};
  });
}

}  // namespace gyre
