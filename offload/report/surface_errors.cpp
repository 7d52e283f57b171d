// SPDX-License-Identifier: Apache-2.0
#include "offload/report/surface_errors.h"

#include "common/geometry/quantile.h"
#include "common/mesh/closest_point.h"
#include "common/parallel/parallel.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace gyre {

namespace {

// Uniform in [0, 1); the standard's distributions differ between libraries.
double uniform(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1.0p-53;
}

}  // namespace

std::vector<Eigen::Vector3d> sample_surface(const TriangleMesh& mesh, std::size_t count, std::uint64_t seed) {
  std::vector<double> area_before(1, 0.0);
  for (const Eigen::Vector3i& t : mesh.triangles) {
    const Eigen::Vector3d& a = mesh.vertices[t[0]];
    area_before.push_back(area_before.back() + 0.5 * (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).norm());
  }
  std::vector<Eigen::Vector3d> points;
  if (area_before.back() <= 0) return points;
  points.reserve(count);
  std::mt19937_64 random(seed);
  for (std::size_t i = 0; i < count; ++i) {
    const double at = (static_cast<double>(i) + uniform(random)) / static_cast<double>(count) * area_before.back();
    const auto next = std::upper_bound(area_before.begin(), area_before.end(), at);
    const auto triangle = std::min<std::size_t>(next - area_before.begin(), mesh.triangles.size()) - 1;
    const Eigen::Vector3i& t = mesh.triangles[triangle];
    double u = uniform(random), v = uniform(random);
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    const Eigen::Vector3d& a = mesh.vertices[t[0]];
    points.emplace_back(a + u * (mesh.vertices[t[1]] - a) + v * (mesh.vertices[t[2]] - a));
  }
  return points;
}

std::vector<double> distances_to_surface(std::span<const Eigen::Vector3d> points, const TriangleMesh& mesh,
                                         int threads) {
  std::vector<double> distances(points.size(), std::numeric_limits<double>::infinity());
  const ClosestPoint surface(mesh);
  parallel_for(points.size(), threads, [&](std::size_t i) {
    if (const auto nearest = surface.nearest(points[i])) distances[i] = nearest->distance;
  });
  return distances;
}

std::vector<double> distances_to_cloud(std::span<const Eigen::Vector3d> points, std::span<const Eigen::Vector3d> cloud,
                                       int threads) {
  // A point is a triangle whose corners coincide.
  TriangleMesh corners;
  corners.vertices.assign(cloud.begin(), cloud.end());
  for (std::size_t i = 0; i < cloud.size(); ++i)
    corners.triangles.emplace_back(Eigen::Vector3i::Constant(static_cast<int>(i)));
  return distances_to_surface(points, corners, threads);
}

std::vector<int> visible_vertices(const TriangleMesh& mesh, std::span<const std::pair<Camera, Pose>> cameras,
                                  int threads) {
  constexpr double margin = 1e-4;  // metres: the triangles around the vertex itself do not hide it
  const ClosestPoint surface(mesh);
  std::vector<char> visible(mesh.vertices.size(), 0);
  parallel_for(mesh.vertices.size(), threads, [&](std::size_t i) {
    const Eigen::Vector3d& v = mesh.vertices[i];
    visible[i] = std::any_of(cameras.begin(), cameras.end(), [&](const std::pair<Camera, Pose>& view) {
      const auto pixel = view.first.project(view.second * v);
      return pixel && pixel->x() >= 0 && pixel->y() >= 0 && pixel->x() < view.first.width &&
             pixel->y() < view.first.height && !surface.occluded(v, centre_of(view.second), margin);
    });
  });
  std::vector<int> indices;
  for (std::size_t i = 0; i < visible.size(); ++i)
    if (visible[i] != 0) indices.push_back(static_cast<int>(i));
  return indices;
}

Similarity align_surfaces(const TriangleMesh& target, const TriangleMesh& source, std::span<const int> source_vertices,
                          const Similarity& initial, const SurfaceAlignmentOptions& options) {
  const ClosestPoint to_target(target), to_source(source);
  const std::vector<Eigen::Vector3d> on_target = sample_surface(target, options.samples, options.seed);
  std::vector<Eigen::Vector3d> on_source;
  const std::size_t stride =
      std::max<std::size_t>(1, source_vertices.size() / std::max<std::size_t>(1, options.samples));
  for (std::size_t i = 0; i < source_vertices.size(); i += stride)
    on_source.push_back(source.vertices[source_vertices[i]]);

  constexpr int untrimmed = 10;  // iterations before far pairs are told from those that are not there yet
  Similarity target_from_source = initial;
  std::vector<Eigen::Vector3d> a(on_source.size() + on_target.size()), b(a.size());
  for (int iteration = 0; iteration < options.iterations; ++iteration) {
    const Similarity source_from_target = target_from_source.inverse();
    parallel_for(a.size(), 0, [&](std::size_t i) {
      if (i < on_source.size()) {
        b[i] = on_source[i];
        const auto nearest = to_target.nearest(target_from_source * b[i]);
        a[i] = nearest ? nearest->position : target_from_source * b[i];
      } else {
        a[i] = on_target[i - on_source.size()];
        const auto nearest = to_source.nearest(source_from_target * a[i]);
        b[i] = nearest ? nearest->position : source_from_target * a[i];
      }
    });
    // What only one of the surfaces has, or holds elsewhere, has no say in where the rest lies.
    std::vector<double> distances(a.size());
    for (std::size_t i = 0; i < a.size(); ++i) distances[i] = (a[i] - target_from_source * b[i]).norm();
    const double limit =
        iteration < untrimmed ? std::numeric_limits<double>::infinity() : 5.0 * median(distances) + 1e-6;
    std::vector<Eigen::Vector3d> kept_a, kept_b;
    for (std::size_t i = 0; i < a.size(); ++i)
      if (distances[i] <= limit) {
        kept_a.push_back(a[i]);
        kept_b.push_back(options.with_scale ? b[i] : initial.scale * b[i]);  // a fixed scale is put into the points
      }
    auto step = align_points(kept_a, kept_b, options.with_scale);
    if (!step) break;
    if (!options.with_scale) step->scale = initial.scale;
    const Eigen::Matrix4d change = step->matrix() - target_from_source.matrix();
    target_from_source = *step;
    if (iteration >= untrimmed && change.cwiseAbs().maxCoeff() < 1e-9) break;
  }
  return target_from_source;
}

}  // namespace gyre
