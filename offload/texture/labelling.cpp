// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/labelling.h"

#include "offload/texture/minimum_cut.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace gyre {

namespace {

constexpr std::size_t enough_views = 4;  // for a median to mean something

// Component-wise median colour of a triangle's observations.
Eigen::Vector3f median_colour(std::span<const Observation> observations) {
  Eigen::Vector3f median;
  std::vector<float> values(observations.size());
  for (int c = 0; c < 3; ++c) {
    std::transform(observations.begin(), observations.end(), values.begin(),
                   [c](const Observation& o) { return o.colour[c]; });
    std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
    median[c] = values[values.size() / 2];
  }
  return median;
}

// The labelling energy, with the colours of edges looked up in the photographs when asked for.
class Energy {
 public:
  Energy(std::span<const Eigen::Vector3d> vertices, std::span<const SharedEdge> edges,
         const std::vector<std::vector<Candidate>>& candidates, std::span<const Photo> photos,
         const LabelOptions& options)
      : vertices_(vertices), edges_(edges), candidates_(candidates), photos_(photos), options_(options) {}

  float data(int face, int photo) const {
    for (const Candidate& c : candidates_[face]) {
      if (c.photo == photo) return c.cost;
    }
    return std::numeric_limits<float>::infinity();
  }

  // A metric over photographs for a fixed edge, as alpha expansion needs.
  float seam(const SharedEdge& edge, int a, int b) const {
    if (a == b) return 0.0F;
    const float difference = (colour(edge, a) - colour(edge, b)).lpNorm<1>() / (3.0F * 255.0F);
    return static_cast<float>(options_.seam_length + options_.seam_colour * difference);
  }

  std::span<const SharedEdge> edges() const { return edges_; }

 private:
  // Mean over two points of the edge.
  Eigen::Vector3f colour(const SharedEdge& edge, int photo) const {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (const double t : {0.3, 0.7}) {
      const Eigen::Vector3d x = (1 - t) * vertices_[edge.vertex[0]] + t * vertices_[edge.vertex[1]];
      const auto pixel = photos_[photo].camera.project(photos_[photo].cam_from_world * x);
      if (pixel) sum += 0.5F * sample(photos_[photo], *pixel);
    }
    return sum;
  }

  std::span<const Eigen::Vector3d> vertices_;
  std::span<const SharedEdge> edges_;
  const std::vector<std::vector<Candidate>>& candidates_;
  std::span<const Photo> photos_;
  const LabelOptions& options_;
};

// The best set of triangles to switch to photograph `alpha`, by one minimum cut. Returns whether anything changed.
bool expand(const Energy& energy, int alpha, std::span<const int> may_take, std::vector<int>& label,
            std::vector<int>& node_of) {
  std::vector<int> faces;
  for (const int f : may_take) {
    if (label[f] == alpha) continue;
    node_of[f] = static_cast<int>(faces.size());
    faces.push_back(f);
  }
  if (faces.empty()) return false;
  MinimumCut cut(faces.size());  // 1: takes alpha
  for (std::size_t n = 0; n < faces.size(); ++n)
    cut.add_cost(static_cast<int>(n), energy.data(faces[n], alpha) - energy.data(faces[n], label[faces[n]]));
  for (const SharedEdge& edge : energy.edges()) {
    const int f = edge.face[0];
    const int g = edge.face[1];
    const int n = node_of[f];
    const int m = node_of[g];
    if ((n < 0 && m < 0) || label[f] < 0 || label[g] < 0) continue;
    const float keep = energy.seam(edge, label[f], label[g]);
    if (n >= 0 && m >= 0) {
      const float second = energy.seam(edge, label[f], alpha);  // only g switches
      const float first = energy.seam(edge, alpha, label[g]);   // only f switches
      cut.add_cost(n, first - keep);
      cut.add_cost(m, -first);
      cut.add_penalty(n, m, second + first - keep);
    } else if (n >= 0) {
      cut.add_cost(n, energy.seam(edge, alpha, label[g]) - keep);
    } else {
      cut.add_cost(m, energy.seam(edge, label[f], alpha) - keep);
    }
  }
  const std::vector<std::uint8_t> takes = cut.solve();
  bool changed = false;
  for (std::size_t n = 0; n < faces.size(); ++n) {
    node_of[faces[n]] = -1;
    if (takes[n] == 0) continue;
    label[faces[n]] = alpha;
    changed = true;
  }
  return changed;
}

}  // namespace

std::vector<std::vector<Candidate>> label_candidates(const ObservationTable& table, const LabelOptions& options) {
  std::vector<std::vector<Candidate>> candidates(table.start.size() - 1);
  for (std::size_t t = 0; t < candidates.size(); ++t) {
    const std::span<const Observation> seen = table.of(t);
    if (seen.empty()) continue;
    const Eigen::Vector3f median = median_colour(seen);
    const auto differs = [&](const Observation& o) { return (o.colour - median).norm() / options.colour_tolerance; };
    const auto agreeing = std::count_if(seen.begin(), seen.end(), [&](const auto& o) { return differs(o) <= 1.0; });
    const auto needed = options.agreement * static_cast<double>(seen.size());
    if (seen.size() >= enough_views && static_cast<double>(agreeing) < needed) continue;
    ViewQuality quality = ViewQuality::none;
    for (const Observation& o : seen) quality = std::max(quality, o.quality);
    float best = 0;
    for (const Observation& o : seen) {
      if (o.quality == quality) best = std::max(best, o.score);
    }
    for (const Observation& o : seen) {
      if (o.quality != quality) continue;
      float cost = 1.0F - o.score / best;
      if (seen.size() >= enough_views) {
        const double off = differs(o);
        cost += static_cast<float>(options.disagreement * std::min(4.0, off * off));
      }
      candidates[t].push_back({o.photo, cost, o.quality});
    }
    std::stable_sort(candidates[t].begin(), candidates[t].end(),
                     [](const Candidate& a, const Candidate& b) { return a.cost < b.cost; });
    if (candidates[t].size() > static_cast<std::size_t>(options.candidates)) candidates[t].resize(options.candidates);
  }
  return candidates;
}

std::vector<int> choose_photos(std::span<const Eigen::Vector3d> vertices, std::span<const SharedEdge> edges,
                               const std::vector<std::vector<Candidate>>& candidates, std::span<const Photo> photos,
                               const LabelOptions& options) {
  std::vector<int> label(candidates.size(), -1);
  std::vector<std::vector<int>> may_take(photos.size());
  for (std::size_t f = 0; f < candidates.size(); ++f) {
    if (!candidates[f].empty()) label[f] = candidates[f].front().photo;
    for (const Candidate& c : candidates[f]) may_take[c.photo].push_back(static_cast<int>(f));
  }
  const Energy energy(vertices, edges, candidates, photos, options);
  std::vector<int> node_of(candidates.size(), -1);
  for (int sweep = 0; sweep < options.sweeps; ++sweep) {
    bool changed = false;
    for (std::size_t alpha = 0; alpha < photos.size(); ++alpha) {
      changed |= expand(energy, static_cast<int>(alpha), may_take[alpha], label, node_of);
    }
    if (!changed) break;
  }
  return label;
}

}  // namespace gyre
