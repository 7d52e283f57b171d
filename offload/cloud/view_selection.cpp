// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/view_selection.h"

#include "offload/cloud/subject_proxy.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gyre {
namespace {

double pair_score(const std::vector<Sighting>& a, const std::vector<Sighting>& b, const ViewSelectionOptions& options) {
  double score = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (!a[i].seen || !b[i].seen) continue;
    const double cosine = std::clamp(a[i].direction.dot(b[i].direction), -1.0, 1.0);
    const double angle = std::acos(cosine) * 180.0 / std::numbers::pi;
    if (angle < options.min_angle_deg || angle > options.max_angle_deg) continue;
    const double sigma = 0.5 * (angle < options.best_angle_deg ? options.best_angle_deg : options.max_angle_deg);
    const double off = (angle - options.best_angle_deg) / sigma;
    const double finer = std::max(a[i].pixels_per_metre, b[i].pixels_per_metre);
    score += std::exp(-0.5 * off * off) * std::min(a[i].pixels_per_metre, b[i].pixels_per_metre) / finer;
  }
  return score;
}

}  // namespace

std::vector<std::vector<int>> select_neighbours(std::span<const StereoView> views, const std::vector<char>& use,
                                                const SubjectRegion& region, const ViewSelectionOptions& options) {
  const std::vector<ProxyPoint> points = proxy_surface(region);
  std::vector<std::vector<Sighting>> seen;
  seen.reserve(views.size());
  for (const StereoView& view : views) seen.push_back(sightings(view, points));

  std::vector<std::vector<int>> neighbours(views.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (use[i] == 0) continue;
    std::vector<std::pair<double, int>> ranked;
    for (std::size_t j = 0; j < views.size(); ++j) {
      const double score = i == j || use[j] == 0 ? 0.0 : pair_score(seen[i], seen[j], options);
      if (score > 0.0) ranked.emplace_back(-score, static_cast<int>(j));
    }
    std::sort(ranked.begin(), ranked.end());
    if (ranked.size() > static_cast<std::size_t>(options.count)) ranked.resize(options.count);
    for (const auto& [score, j] : ranked) neighbours[i].push_back(j);
  }
  return neighbours;
}

}  // namespace gyre
