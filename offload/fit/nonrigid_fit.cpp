// SPDX-License-Identifier: Apache-2.0
#include "offload/fit/nonrigid_fit.h"

#include "offload/fit/cloud_preparation.h"
#include "offload/fit/edge_laplacian.h"

#include <cmath>

namespace gyre {

namespace {

double trust(BodyRegion region, double hand_weight) {
  return region == BodyRegion::left_hand || region == BodyRegion::right_hand ? hand_weight : 1.0;
}

double stiffness_of(BodyRegion region, const NonrigidFitOptions& options) {
  switch (region) {
    case BodyRegion::left_hand:
    case BodyRegion::right_hand:
      return options.hand_stiffness;
    case BodyRegion::left_foot:
    case BodyRegion::right_foot:
      return options.foot_stiffness;
    case BodyRegion::head:
    case BodyRegion::face:
      return options.head_stiffness;
    default:
      return 1.0;
  }
}

// Far pairs count less; both directions get the same sum of weights when complete.
void weigh(std::vector<Match>& matches, const BodyTemplate& body, const std::vector<Eigen::Vector3d>& x, double radius,
           double share, double hand_weight) {
  for (Match& m : matches) {
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    double trusted = 0.0;
    for (int k = 0; k < 3; ++k) {
      at += m.weights[k] * x[m.corners[k]];
      trusted += m.weights[k] * trust(body.regions[m.corners[k]], hand_weight);
    }
    const double ratio = radius * radius / (radius * radius + 4.0 * (at - m.target).squaredNorm());
    m.weight = share * trusted * ratio * ratio;
  }
}

}  // namespace

NonrigidFit fit_nonrigid(const BodyTemplate& body, const OuterSurface& outer, const OrientedPoints& cloud,
                         const std::vector<Eigen::Vector3d>& start, const NonrigidFitOptions& options,
                         const Progress& progress) {
  const TemplatePart* part = body.part("body");
  const std::size_t count = part ? part->vertex_count : start.size();
  const std::size_t triangle_count = part ? part->triangle_count : body.mesh.triangles.size();
  const std::span<const Eigen::Vector3i> triangles(body.mesh.triangles.data(), triangle_count);

  const auto wanted = static_cast<std::size_t>(options.points_per_vertex * static_cast<double>(outer.vertices.size()));
  const OrientedPoints points = thin(cloud, cell_for_count(cloud, wanted));
  const PointIndex cloud_index(points);
  std::vector<double> vertex_stiffness;
  for (std::size_t v = 0; v < count; ++v) vertex_stiffness.push_back(stiffness_of(body.regions[v], options));
  EdgeLaplacian surface_energy({start.begin(), start.begin() + static_cast<std::ptrdiff_t>(count)}, triangles,
                               options.membrane, vertex_stiffness);

  NonrigidFit fit{start, std::vector<bool>(start.size(), false)};
  const int searches = options.steps * options.searches;
  for (int i = 0; i < searches; ++i) {
    if (progress) progress(static_cast<double>(i) / searches, "fitting the surface");
    const int step = i / options.searches;
    const double done = options.steps > 1 ? static_cast<double>(step) / (options.steps - 1) : 1.0;
    const double stiffness = options.first_stiffness * std::pow(options.last_stiffness / options.first_stiffness, done);
    const double radius = options.first_radius * std::pow(options.last_radius / options.first_radius, done);
    const std::vector<Eigen::Vector3d> normals = vertex_normals(fit.vertices, body.mesh.triangles);
    const SearchableSurface surface(outer, fit.vertices, normals);
    const MatchGate gate{radius, options.min_cosine, 8};
    std::vector<Match> matches = match_cloud(points, surface, gate, options.threads);
    weigh(matches, body, fit.vertices, radius, 1.0 / static_cast<double>(points.size()), options.hand_weight);
    std::vector<Match> from_vertices =
        match_vertices(outer.vertices, surface, cloud_index, gate, options.max_slide, options.threads);
    weigh(from_vertices, body, fit.vertices, radius, 1.0 / static_cast<double>(outer.vertices.size()),
          options.hand_weight);
    matches.insert(matches.end(), from_vertices.begin(), from_vertices.end());
    if (i + 1 == searches)
      for (const Match& m : from_vertices) fit.supported[m.corners[0]] = true;

    std::vector<Eigen::Vector3d> x(fit.vertices.begin(), fit.vertices.begin() + static_cast<std::ptrdiff_t>(count));
    for (int turn = 0; turn < options.turns; ++turn) {
      surface_energy.fit_rotations(x, options.threads);
      x = surface_energy.solve(matches, stiffness, x);
    }
    std::copy(x.begin(), x.end(), fit.vertices.begin());
  }
  return fit;
}

}  // namespace gyre
