// SPDX-License-Identifier: Apache-2.0
#include "offload/fit/nonrigid_fit.h"

#include "offload/fit/cloud_preparation.h"
#include "offload/fit/edge_laplacian.h"

#include <Eigen/Geometry>
#include <cmath>

namespace gyre {

namespace {

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

// Distance of each template vertex of the face to the nearest one that is hidden behind lids, lips or nostrils, metres;
// infinite elsewhere.
std::vector<double> distances_to_openings(const BodyTemplate& body, const OuterSurface& outer) {
  const auto of_face = [&](std::size_t v) {
    return body.regions[v] == BodyRegion::face || body.regions[v] == BodyRegion::inner;
  };
  std::vector<bool> seen(body.mesh.vertices.size(), false);
  for (const int v : outer.vertices) seen[v] = true;
  std::vector<int> hidden;
  for (std::size_t v = 0; v < seen.size(); ++v)
    if (!seen[v] && of_face(v)) hidden.push_back(static_cast<int>(v));
  std::vector<double> distances(seen.size(), std::numeric_limits<double>::infinity());
  for (std::size_t v = 0; v < distances.size(); ++v) {
    if (!of_face(v)) continue;
    double least = std::numeric_limits<double>::infinity();
    for (const int h : hidden) least = std::min(least, (body.mesh.vertices[v] - body.mesh.vertices[h]).squaredNorm());
    distances[v] = std::sqrt(least);
  }
  return distances;
}

// How much each vertex follows the cloud. A cloud's noise is larger than the thickness of a lid, and what it shows
// there may be lashes or a wisp of hair: the edges of openings mostly follow what is around them, and the landmarks.
std::vector<double> trust_of(const BodyTemplate& body, const std::vector<double>& to_openings,
                             const NonrigidFitOptions& options) {
  std::vector<double> trust(body.mesh.vertices.size(), 1.0);
  for (std::size_t v = 0; v < trust.size(); ++v) {
    if (body.regions[v] == BodyRegion::left_hand || body.regions[v] == BodyRegion::right_hand)
      trust[v] = options.hand_weight;
    trust[v] *= std::clamp(to_openings[v] / options.opening_reach - 1.0, options.opening_weight, 1.0);
  }
  return trust;
}

// Far pairs count less. Matches come with the confidence of their points, or of those around their vertex.
void weigh(std::vector<Match>& matches, const std::vector<double>& trust, const std::vector<Eigen::Vector3d>& x,
           double radius) {
  for (Match& m : matches) {
    double trusted = 0.0;
    for (int k = 0; k < 3; ++k) trusted += m.weights[k] * trust[m.corners[k]];
    const double ratio = radius * radius / (radius * radius + 4.0 * (place_of(m, x) - m.target).squaredNorm());
    m.weight *= trusted * ratio * ratio;
  }
}

// The pull of the matches at each vertex: weight and, after normalise(), the mean way to go.
struct Pulls {
  std::vector<double> weights;
  std::vector<Eigen::Vector3d> ways;

  explicit Pulls(std::size_t count) : weights(count, 0.0), ways(count, Eigen::Vector3d::Zero()) {}

  void add(const std::vector<Match>& matches, const std::vector<Eigen::Vector3d>& x) {
    for (const Match& m : matches) {
      Eigen::Vector3d way = m.target;
      for (int k = 0; k < 3; ++k) way -= m.weights[k] * x[m.corners[k]];
      for (int k = 0; k < 3; ++k) {
        weights[m.corners[k]] += m.weight * m.weights[k];
        ways[m.corners[k]] += m.weight * m.weights[k] * way;
      }
    }
  }
  void normalise() {
    for (std::size_t v = 0; v < weights.size(); ++v)
      if (weights[v] > 0) ways[v] /= weights[v];
  }
};

class Descent {
 public:
  Descent(const BodyTemplate& body, const OuterSurface& outer, OrientedPoints points,
          const std::vector<LandmarkTarget>& landmarks, const std::vector<Eigen::Vector3d>& reference,
          const std::vector<Eigen::Vector3d>& start, std::span<const double> held, const NonrigidFitOptions& options)
      : body_(body),
        outer_(outer),
        landmarks_(landmarks),
        held_(held),
        options_(options),
        part_(body.part("body")),
        count_(part_ ? part_->vertex_count : start.size()),
        cloud_(std::move(points)),
        to_openings_(distances_to_openings(body, outer)),
        trust_(trust_of(body, to_openings_, options)),
        start_(start),
        x_(start),
        area_(areas()),
        energy_(make_energy(reference)) {}

  // One factorisation: `searches` new sets of correspondences, `turns` of rotations and vertices for each.
  void step(double stiffness, double radius, double landmark_share) {
    for (int search = 0; search < options_.searches; ++search) {
      find_matches(radius);
      for (int turn = 0; turn < options_.turns; ++turn) {
        const std::vector<Eigen::Vector3d> before(x_.begin(), x_.begin() + static_cast<std::ptrdiff_t>(count_));
        Pulls pulls(x_.size());
        pulls.add(matches_, x_);
        pulls.normalise();
        energy_.fit_rotations(before, options_.threads);
        if (search == 0 && turn == 0 && !factorise(pulls.weights, stiffness, landmark_share)) return;
        const std::vector<Eigen::Vector3d> moved = energy_.solve(targets(pulls), before);
        std::copy(moved.begin(), moved.end(), x_.begin());
      }
    }
  }

  const std::vector<Eigen::Vector3d>& vertices() const { return x_; }
  std::vector<double> support() const {
    std::vector<double> support(x_.size(), 0.0);
    // Both directions give a vertex its area each.
    for (const Match& m : matches_)
      for (int k = 0; k < 3; ++k) support[m.corners[k]] += 0.5 * m.weight * m.weights[k];
    for (std::size_t v = 0; v < support.size(); ++v) {
      const double complete = area_[v] * trust_[v];
      support[v] = complete > 0 ? std::min(1.0, support[v] / complete) : 0.0;
    }
    return support;
  }

 private:
  // Share of the outer surface around each vertex.
  std::vector<double> areas() const {
    std::vector<double> areas(start_.size(), 0.0);
    double total = 0.0;
    for (const Eigen::Vector3i& t : outer_.triangles) {
      const double area = (start_[t[1]] - start_[t[0]]).cross(start_[t[2]] - start_[t[0]]).norm();
      for (int k = 0; k < 3; ++k) areas[t[k]] += area;
      total += 3.0 * area;
    }
    if (total > 0)
      for (double& a : areas) a /= total;
    return areas;
  }

  EdgeLaplacian make_energy(const std::vector<Eigen::Vector3d>& reference) const {
    std::vector<double> stiffness;
    for (std::size_t v = 0; v < count_; ++v)
      stiffness.push_back(to_openings_[v] < 2.0 * options_.opening_reach ? options_.opening_stiffness
                                                                         : stiffness_of(body_.regions[v], options_));
    const std::size_t triangles = part_ ? part_->triangle_count : body_.mesh.triangles.size();
    return EdgeLaplacian({reference.begin(), reference.begin() + static_cast<std::ptrdiff_t>(count_)},
                         {body_.mesh.triangles.data(), triangles}, options_.membrane, stiffness);
  }

  void find_matches(double radius) {
    const std::vector<Eigen::Vector3d> normals = vertex_normals(x_, body_.mesh.triangles);
    const SearchableSurface surface(outer_, x_, normals);
    const MatchGate gate{radius, options_.min_cosine, 8};
    // Both directions sum to 1 when complete, and both stand for area: the cloud is thinned evenly.
    matches_ = match_cloud(cloud_.points(), surface, gate, options_.threads);
    for (Match& m : matches_) m.weight /= static_cast<double>(cloud_.points().size());
    std::vector<Match> from_vertices =
        match_vertices(outer_.vertices, surface, cloud_, gate, options_.max_slide, options_.threads);
    for (Match& m : from_vertices) m.weight *= area_[m.corners[0]];
    matches_.insert(matches_.end(), from_vertices.begin(), from_vertices.end());
    weigh(matches_, trust_, x_, radius);
  }

  bool factorise(const std::vector<double>& weights, double stiffness, double landmark_share) {
    total_ = 0.0;
    double landmark_total = 0.0;
    for (const double w : weights) total_ += w;
    for (const LandmarkTarget& l : landmarks_) landmark_total += l.trust;
    data_weights_.assign(count_, 0.0);
    landmark_weights_.assign(count_, 0.0);
    held_weights_.assign(count_, 0.0);
    // A held vertex outweighs its share of the data and of the surface around it.
    const double hold = 1e3 / static_cast<double>(count_);
    for (std::size_t v = 0; v < count_; ++v) {
      if (total_ > 0) data_weights_[v] = weights[v] / total_;
      if (!held_.empty()) held_weights_[v] = hold * held_[v];
    }
    for (const LandmarkTarget& l : landmarks_) landmark_weights_[l.vertex] += landmark_share * l.trust / landmark_total;
    std::vector<double> all(count_);
    for (std::size_t v = 0; v < count_; ++v) all[v] = data_weights_[v] + landmark_weights_[v] + held_weights_[v];
    return energy_.factorise(all, stiffness);
  }

  std::vector<Eigen::Vector3d> targets(const Pulls& pulls) const {
    std::vector<Eigen::Vector3d> sums(count_, Eigen::Vector3d::Zero());
    for (std::size_t v = 0; v < count_; ++v) {
      sums[v] = held_weights_[v] * start_[v];
      if (data_weights_[v] <= 0) continue;
      const double share = std::min(1.0, pulls.weights[v] / (total_ * data_weights_[v]));
      sums[v] += data_weights_[v] * (x_[v] + share * pulls.ways[v]);
    }
    // Several landmarks may share a vertex: each pulls by its trust.
    std::vector<double> trusts(count_, 0.0);
    for (const LandmarkTarget& l : landmarks_) trusts[l.vertex] += l.trust;
    for (const LandmarkTarget& l : landmarks_)
      sums[l.vertex] += landmark_weights_[l.vertex] * (l.trust / trusts[l.vertex]) * l.position;
    for (std::size_t v = 0; v < count_; ++v)
      if (const double w = data_weights_[v] + landmark_weights_[v] + held_weights_[v]; w > 0) sums[v] /= w;
    return sums;
  }

  const BodyTemplate& body_;
  const OuterSurface& outer_;
  const std::vector<LandmarkTarget>& landmarks_;
  std::span<const double> held_;
  const NonrigidFitOptions& options_;
  const TemplatePart* part_;
  std::size_t count_;  // vertices of the body part
  PointIndex cloud_;
  std::vector<double> to_openings_, trust_;
  const std::vector<Eigen::Vector3d>& start_;
  std::vector<Eigen::Vector3d> x_;
  std::vector<double> area_;
  EdgeLaplacian energy_;
  std::vector<Match> matches_;
  // Weights of the factorisation, one a vertex. The data's sum to 1, and did to total_ before.
  std::vector<double> data_weights_, landmark_weights_, held_weights_;
  double total_ = 0.0;
};

}  // namespace

NonrigidFit fit_nonrigid(const BodyTemplate& body, const OuterSurface& outer, const OrientedPoints& cloud,
                         const std::vector<LandmarkTarget>& landmarks, const std::vector<Eigen::Vector3d>& reference,
                         const std::vector<Eigen::Vector3d>& start, std::span<const double> held,
                         const NonrigidFitOptions& options, const Progress& progress) {
  if (cloud.size() == 0) return {start, std::vector<double>(start.size(), 0.0)};
  const auto wanted = static_cast<std::size_t>(options.points_per_vertex * static_cast<double>(outer.vertices.size()));
  Descent descent(body, outer, thin(cloud, cell_for_count(cloud, wanted)), landmarks, reference, start, held, options);
  for (int i = 0; i < options.steps; ++i) {
    const double done = options.steps > 1 ? static_cast<double>(i) / (options.steps - 1) : 1.0;
    const auto between = [&](double first, double last) { return first * std::pow(last / first, done); };
    if (progress) progress(static_cast<double>(i) / options.steps, "fitting the surface");
    descent.step(between(options.first_stiffness, options.last_stiffness),
                 between(options.first_radius, options.last_radius),
                 between(options.first_landmark_share, options.last_landmark_share));
  }
  return {descent.vertices(), descent.support()};
}

}  // namespace gyre
