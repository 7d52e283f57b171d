// SPDX-License-Identifier: Apache-2.0
#include "offload/fit/person_fit.h"

#include "offload/body/face_contacts.h"
#include "offload/body/inner_parts.h"
#include "offload/fit/cloud_preparation.h"
#include "offload/fit/rest_surface.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace gyre {

namespace {

constexpr double trusted_support = 0.3;  // regions with a smaller share of supported vertices are mostly guessed
constexpr double toe_bonus = 0.2;        // metres of misfit for each height the feet point forward

std::vector<double> headings_to_try(const Stance& stance) {
  std::vector<double> headings{heading(stance, true), heading(stance, false)};
  // Without outstretched arms the widest direction may be front to back.
  if (stance.elongation < 1.6)
    for (const bool left : {true, false}) headings.push_back(heading(stance, left) + 0.5 * std::numbers::pi);
  return headings;
}

Progress part_of(const Progress& progress, double from, double to) {
  if (!progress) return {};
  return
      [progress, from, to](double fraction, std::string_view what) { progress(from + (to - from) * fraction, what); };
}

std::string shortened(double value, int digits) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << std::fixed << std::setprecision(digits) << value;
  return text.str();
}

void check_person(const Stance& stance, const CoarseFit& fit, bool metric, std::vector<std::string>& warnings) {
  if (metric && (stance.height < 1.0 || stance.height > 2.3))
    warnings.push_back("the cloud is " + shortened(stance.height, 2) + " m high, which no grown person is");
  if (stance.elongation < 1.6)
    warnings.emplace_back("the upper body is as deep as it is wide: no arms stand out as in an A-pose");
  if (fit.misfit > 0.025)
    warnings.push_back("the body fits the cloud to only " + shortened(1000 * fit.misfit, 0) +
                       " mm: is this a person standing in A-pose?");
}

// Distances of the cloud to the surface, with everything out of reach at the reach.
void measure_residual(const OuterSurface& outer, const OrientedPoints& cloud, const BodyTemplate& body, int threads,
                      PersonFit& fit) {
  constexpr double reach = 0.1;
  const std::vector<Eigen::Vector3d> normals = vertex_normals(fit.vertices, body.mesh.triangles);
  const SearchableSurface surface(outer, fit.vertices, normals);
  std::vector<double> distances;
  for (const Match& m : match_cloud(cloud, surface, {reach, 0.0, 12}, threads)) {
    Eigen::Vector3d x = Eigen::Vector3d::Zero();
    for (int k = 0; k < 3; ++k) x += m.weights[k] * fit.vertices[m.corners[k]];
    distances.push_back((x - m.target).norm());
  }
  distances.resize(cloud.size(), reach);
  std::sort(distances.begin(), distances.end());
  fit.residual_mean = std::accumulate(distances.begin(), distances.end(), 0.0) / static_cast<double>(distances.size());
  fit.residual_p95 = distances[static_cast<std::size_t>(0.95 * static_cast<double>(distances.size() - 1))];
}

void measure_support(const BodyTemplate& body, const OuterSurface& outer, const std::vector<bool>& supported,
                     PersonFit& fit) {
  std::map<std::string, std::pair<int, int>> counts;
  for (const int v : outer.vertices) {
    auto& [held, all] = counts[region_name(body.regions[v])];
    held += supported[v] ? 1 : 0;
    ++all;
  }
  for (const auto& [name, count] : counts) {
    const double share = static_cast<double>(count.first) / count.second;
    fit.support[name] = share;
    if (share < trusted_support)
      fit.warnings.push_back("the cloud shows only " + shortened(100 * share, 0) + " % of the " + name +
                             ": it is mostly the template's");
  }
}

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

Result<PersonFit> fit_person(const BodyTemplate& body, const PointCloud& cloud, const PersonFitOptions& options,
                             const Progress& progress) {
  const Result<OrientedPoints> points = prepare_cloud(cloud);
  if (!points) return tl::unexpected(points.error());
  const Stance stance = measure_stance(*points);
  const OuterSurface outer = outer_surface(body);

  CoarseFitOptions coarse = options.coarse;
  coarse.threads = options.threads;
  if (!options.metric) coarse.scale_deviation = 0.2;
  const std::vector<double> headings = headings_to_try(stance);
  std::vector<std::pair<FacingGuess, CoarseFit>> tried;
  for (std::size_t i = 0; i < headings.size(); ++i) {
    const double begin = 0.5 * static_cast<double>(i) / static_cast<double>(headings.size());
    const double end = 0.5 * static_cast<double>(i + 1) / static_cast<double>(headings.size());
    CoarseFit fit =
        fit_coarse(body, outer, *points, stand_like(body, stance, headings[i]), coarse, part_of(progress, begin, end));
    FacingGuess guess{headings[i], fit.misfit};
    // The feet were measured across the lateral axis only.
    if (i < 2) guess.toes = (i == 0 ? 1.0 : -1.0) * stance.toes;
    guess.cost = guess.misfit - toe_bonus * std::clamp(guess.toes, -0.05, 0.05);
    tried.emplace_back(guess, std::move(fit));
  }
  std::stable_sort(tried.begin(), tried.end(),
                   [](const auto& a, const auto& b) { return a.first.cost < b.first.cost; });

  PersonFit fit;
  for (const auto& [guess, unused] : tried) fit.guesses.push_back(guess);
  const CoarseFit& best = tried.front().second;
  fit.state = best.state;
  check_person(stance, best, options.metric, fit.warnings);

  const PosedBody posed = evaluate(body, best.state);
  NonrigidFitOptions fine = options.nonrigid;
  fine.threads = options.threads;
  NonrigidFit surface = fit_nonrigid(body, outer, *points, posed.vertices, fine, part_of(progress, 0.5, 0.95));
  carry_inner_parts(body, posed.vertices, surface.vertices);
  settle_face(body, surface.vertices);
  fit.vertices = std::move(surface.vertices);

  RestSurface rest = unpose(body, fit.vertices, posed.rest_joints, fit.state.pose);
  fit.pose = std::move(rest.pose);
  fit.rest_vertices = std::move(rest.vertices);
  fit.rest_joints = std::move(rest.joints);
  fit.posed_from_rest = std::move(rest.posed_from_rest);
  for (const int v : outer.vertices) fit.stature = std::max(fit.stature, fit.rest_vertices[v].y());
  measure_support(body, outer, surface.supported, fit);
  measure_residual(outer, *points, body, options.threads, fit);
  if (progress) progress(1.0, "body fitted");
  return fit;
}

}  // namespace gyre
