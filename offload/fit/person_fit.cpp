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

constexpr double toe_bonus = 0.2;        // metres of misfit for each height the feet point forward
constexpr double landmark_bonus = 0.03;  // metres of misfit for the landmarks' heading against the opposite one
constexpr double sure = 0.8;             // certainty of the landmarks' heading above which no other is tried

std::vector<double> headings_to_try(const Stance& stance, const LandmarkSet& landmarks) {
  if (landmarks.yaw && landmarks.yaw_certainty > sure) return {*landmarks.yaw};
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

// Height of the highest outer vertex.
double top_of(const OuterSurface& outer, const std::vector<Eigen::Vector3d>& vertices) {
  double top = -std::numeric_limits<double>::infinity();
  for (const int v : outer.vertices) top = std::max(top, vertices[v].y());
  return top;
}

// What the person stands on: the world's floor where the soles are near it, which no camera sees.
double floor_of(const OuterSurface& outer, const std::vector<Eigen::Vector3d>& vertices) {
  constexpr double near = 0.02;  // metres
  double lowest = std::numeric_limits<double>::infinity();
  for (const int v : outer.vertices) lowest = std::min(lowest, vertices[v].y());
  return std::abs(lowest) < near ? 0.0 : lowest;
}

// Coarse fits from every heading that may be; the cheapest one, and all of them in fit.guesses.
CoarseFit fit_every_way(const BodyTemplate& body, const OuterSurface& outer, const OrientedPoints& points,
                        const LandmarkSet& landmarks, const std::vector<LandmarkTarget>& targets, const Stance& stance,
                        const PersonFitOptions& options, const Progress& progress, PersonFit& fit) {
  CoarseFitOptions coarse = options.coarse;
  coarse.threads = options.threads;
  if (!options.metric) coarse.scale_deviation = 0.2;
  const std::vector<double> headings = headings_to_try(stance, landmarks);
  std::vector<std::pair<FacingGuess, CoarseFit>> tried;
  for (std::size_t i = 0; i < headings.size(); ++i) {
    const double begin = static_cast<double>(i) / static_cast<double>(headings.size());
    const double end = static_cast<double>(i + 1) / static_cast<double>(headings.size());
    CoarseFit way = fit_coarse(body, outer, points, targets, stand_like(body, stance, headings[i]), coarse,
                               part_of(progress, begin, end));
    FacingGuess guess{headings[i], way.misfit};
    // The feet were measured across the lateral axis only.
    guess.toes = stance.toes * std::cos(headings[i] - heading(stance, true));
    guess.cost = guess.misfit - toe_bonus * std::clamp(guess.toes, -0.05, 0.05);
    if (landmarks.yaw)
      guess.cost += landmark_bonus * landmarks.yaw_certainty * 0.5 * (1.0 - std::cos(headings[i] - *landmarks.yaw));
    tried.emplace_back(guess, std::move(way));
  }
  std::stable_sort(tried.begin(), tried.end(),
                   [](const auto& a, const auto& b) { return a.first.cost < b.first.cost; });
  for (const auto& [guess, unused] : tried) fit.guesses.push_back(guess);
  return tried.front().second;
}

// The head once more, with a point density of its own and a schedule that ends softer; everything else stays.
NonrigidFit refit_head(const BodyTemplate& body, const OuterSurface& outer, const OrientedPoints& points,
                       const std::vector<LandmarkTarget>& targets, const std::vector<Eigen::Vector3d>& reference,
                       const std::vector<Eigen::Vector3d>& start, const PersonFitOptions& options,
                       const Progress& progress) {
  const OuterSurface head = part_of_surface(
      outer, [&](int v) { return body.regions[v] == BodyRegion::head || body.regions[v] == BodyRegion::face; });
  if (head.triangles.empty()) return {start, std::vector<double>(start.size(), 0.0)};
  std::vector<double> held = head_shares(body);
  for (double& h : held) h = 1.0 - std::min(1.0, h);
  std::vector<LandmarkTarget> of_face;
  for (const LandmarkTarget& l : targets)
    if (on_head(l.name)) of_face.push_back(l);
  NonrigidFitOptions fine = options.head_surface;
  fine.threads = options.threads;
  return fit_nonrigid(body, head, points_near(points, head, start, 0.03), of_face, reference, start, held, fine,
                      progress);
}

}  // namespace

NonrigidFitOptions head_surface_options() {
  NonrigidFitOptions options;
  options.first_stiffness = 0.1;
  options.last_stiffness = 1e-2;
  options.steps = 4;
  options.first_radius = 0.02;
  options.last_radius = 0.01;
  options.max_slide = 0.008;
  return options;
}

Result<PersonFit> fit_person(const BodyTemplate& body, const PointCloud& cloud, const LandmarkSet& landmarks,
                             const PersonFitOptions& options, const Progress& progress) {
  const Result<OrientedPoints> points = prepare_cloud(cloud);
  if (!points) return tl::unexpected(points.error());
  const Stance stance = measure_stance(*points);
  const OuterSurface outer = outer_surface(body);
  const std::vector<LandmarkTarget> targets = landmark_targets(body, landmarks);
  PersonFit fit;

  const CoarseFit coarse =
      fit_every_way(body, outer, *points, landmarks, targets, stance, options, part_of(progress, 0.0, 0.5), fit);
  check_person(stance, coarse, options.metric, fit.warnings);

  if (progress) progress(0.5, "placing the head");
  HeadAlignmentOptions head_options = options.head;
  head_options.threads = options.threads;
  const HeadAlignment head = align_head(body, outer, *points, targets, coarse.state, head_options);
  fit.state = head.state;

  NonrigidFitOptions fine = options.nonrigid;
  fine.threads = options.threads;
  const NonrigidFit surface =
      fit_nonrigid(body, outer, *points, targets, head.vertices, head.vertices, {}, fine, part_of(progress, 0.52, 0.8));
  NonrigidFit with_head =
      refit_head(body, outer, *points, targets, head.vertices, surface.vertices, options, part_of(progress, 0.8, 0.95));
  for (std::size_t v = 0; v < with_head.support.size(); ++v)
    with_head.support[v] = std::max(with_head.support[v], surface.support[v]);
  carry_inner_parts(body, head.vertices, with_head.vertices);
  settle_face(body, with_head.vertices);
  fit.vertices = std::move(with_head.vertices);

  RestSurface rest = unpose(body, fit.vertices, evaluate(body, fit.state).rest_joints, fit.state.pose);
  fit.pose = std::move(rest.pose);
  fit.rest_vertices = std::move(rest.vertices);
  fit.rest_joints = std::move(rest.joints);
  fit.posed_from_rest = std::move(rest.posed_from_rest);

  if (progress) progress(0.95, "measuring the fit");
  fit.quality = measure_quality(body, outer, *points, fit.vertices, with_head.support, options.threads);
  for (const std::string& region : fit.quality.prior_only)
    fit.warnings.push_back("the cloud shows only " + shortened(100 * fit.quality.support[region], 0) + " % of the " +
                           region + ": it is mostly the template's");
  fit.stature = top_of(outer, fit.vertices) - floor_of(outer, fit.vertices);
  // Under the hair the head is the aligned one.
  const double hair = fit.quality.support["face"] > 0.3
                          ? std::max(0.0, top_of(outer, fit.vertices) - top_of(outer, head.vertices))
                          : -1.0;
  fit.measures = measure_person(body, fit.rest_vertices, with_head.support, std::max(fit.quality.residual_mean, 0.001),
                                options.scale_deviation, fit.stature, hair);
  if (progress) progress(1.0, "body fitted");
  return fit;
}

}  // namespace gyre
