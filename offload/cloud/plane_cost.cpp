// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/plane_cost.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace gyre {

using Eigen::Vector3f;

PlaneCost::PlaneCost(std::span<const StereoView> views, int reference, std::span<const int> neighbours, int level,
                     const PlaneCostOptions& options, std::span<const std::vector<float>> depths)
    : image_(views[reference].levels[level]), options_(options), weights_(options.patch) {
  const Pose& reference_from_world = views[reference].cam_from_world;
  const Eigen::Matrix3d& k = image_.index_from_camera;
  double baseline_pixels = 0.0;
  for (const int j : neighbours.first(std::min<std::size_t>(neighbours.size(), max_neighbours))) {
    const StereoView& other = views[j];
    const Eigen::Matrix3d& kj = other.levels[level].index_from_camera;
    const Pose other_from_ref = other.cam_from_world * reference_from_world.inverse();
    const Eigen::Matrix3d rotation = other_from_ref.rotation.toRotationMatrix();
    Source source;
    source.image = &other.levels[level].image;
    source.from_reference = (kj * rotation * k.inverse()).cast<float>();
    source.translation = (kj * other_from_ref.translation).cast<float>();
    if (!depths.empty() && !depths[j].empty()) {
      source.depths = depths[j].data();
      source.to_reference = (k * rotation.transpose() * kj.inverse()).cast<float>();
      source.back_translation = (-(k * rotation.transpose() * other_from_ref.translation)).cast<float>();
    }
    baseline_pixels += k(0, 0) * other_from_ref.translation.norm();
    sources_.push_back(source);
  }
  pixel_step_ = static_cast<float>(static_cast<double>(sources_.size()) / baseline_pixels);
}

PlaneSite PlaneCost::site(int x, int y, NeighbourSet compared) const {
  PlaneSite site;
  site.x = x;
  site.y = y;
  site.patch = weights_.reference_patch(image_, x, y);
  const Vector3f index(static_cast<float>(x), static_cast<float>(y), 1.0F);
  for (std::size_t j = 0; j < sources_.size(); ++j) {
    if ((compared >> j & 1U) == 0) continue;
    site.neighbours[site.count] = static_cast<std::uint8_t>(j);
    site.base[site.count++] = sources_[j].from_reference * index;
  }
  return site;
}

std::size_t PlaneCost::wanted(const PlaneSite& site) const {
  return std::min<std::size_t>(options_.best_views, site.count);
}

Vector3f PlaneCost::centre_in(const PlaneSite& site, std::size_t n, const SlantedPlane& plane) const {
  return site.base[n] + sources_[site.neighbours[n]].translation * plane.inverse;
}

float PlaneCost::photometric(const PlaneSite& site, std::size_t n, const SlantedPlane& plane) const {
  const Source& source = sources_[site.neighbours[n]];
  const Vector3f centre = centre_in(site, n, plane);
  const Vector3f along_x = source.from_reference.col(0) + source.translation * plane.slope_x;
  const Vector3f along_y = source.from_reference.col(1) + source.translation * plane.slope_y;
  const PatchMapping mapping{{centre.x(), centre.y(), centre.z()},
                             {along_x.x(), along_x.y(), along_x.z()},
                             {along_y.x(), along_y.y(), along_y.z()}};
  return matching_cost(site.patch, mapping, *source.image, options_.patch.noise);
}

float PlaneCost::geometric(const PlaneSite& site, std::size_t n, const SlantedPlane& plane) const {
  const Source& source = sources_[site.neighbours[n]];
  if (source.depths == nullptr) return 0.0F;
  return options_.consistency_weight * round_trip(site, source, centre_in(site, n, plane));
}

// Distance in pixels between the site and where the neighbour's depth there leads back to.
float PlaneCost::round_trip(const PlaneSite& site, const Source& source, const Vector3f& centre) const {
  const float limit = options_.consistency_limit;
  if (!(centre.z() > 0)) return limit;
  const float u = centre.x() / centre.z();
  const float v = centre.y() / centre.z();
  const int width = source.image->width;
  const int height = source.image->height;
  const float column = u + 0.5F;
  const float row = v + 0.5F;
  // Written so that NaN is outside.
  if (!(column >= 0 && row >= 0 && column < static_cast<float>(width) && row < static_cast<float>(height)))
    return limit;
  const int x = static_cast<int>(column);
  const int y = static_cast<int>(row);
  const float depth = source.depths[static_cast<std::size_t>(y) * width + x];
  if (depth <= 0) return limit;
  const Vector3f back = source.to_reference * Vector3f(u, v, 1.0F) + source.back_translation / depth;
  if (!(back.z() > 0)) return limit;
  const float dx = back.x() / back.z() - static_cast<float>(site.x);
  const float dy = back.y() / back.z() - static_cast<float>(site.y);
  return std::min(std::sqrt(dx * dx + dy * dy), limit);
}

float PlaneCost::judge(const PlaneSite& site, const SlantedPlane& plane, float limit) const {
  const std::size_t needed = wanted(site);
  const float limit_sum = limit * static_cast<float>(needed);
  float sum = 0;
  if (site.count == needed) {
    // All count, so that any part of the sum may be too much; the cheap part comes first.
    for (std::size_t n = 0; n < needed; ++n) sum += geometric(site, n, plane);
    for (std::size_t n = 0; n < needed; ++n) {
      if (sum >= limit_sum) return worst_cost * 2;
      sum += photometric(site, n, plane);
    }
    return sum / static_cast<float>(needed);
  }
  std::array<float, max_neighbours> best;
  for (std::size_t n = 0; n < site.count; ++n) {
    const float cost = geometric(site, n, plane) + photometric(site, n, plane);
    std::size_t at = std::min(n, needed);
    for (; at > 0 && best[at - 1] > cost; --at) {
      if (at < needed) best[at] = best[at - 1];
    }
    if (at < needed) best[at] = cost;
    // At least this many of those so far stay among the best, whatever the remaining ones cost.
    const std::size_t remaining = site.count - n - 1;
    sum = 0;
    for (std::size_t k = 0; k + remaining < needed; ++k) sum += best[k];
    if (sum >= limit_sum) return worst_cost * 2;
  }
  return sum / static_cast<float>(needed);
}

PlaneCost::Ranking PlaneCost::rank(const PlaneSite& site, const SlantedPlane& plane, int kept) const {
  std::array<std::pair<float, std::size_t>, max_neighbours> ranked;
  for (std::size_t n = 0; n < site.count; ++n) {
    ranked[n] = {geometric(site, n, plane) + photometric(site, n, plane), site.neighbours[n]};
  }
  std::sort(ranked.begin(), ranked.begin() + static_cast<std::ptrdiff_t>(site.count));
  Ranking ranking;
  const std::size_t needed = wanted(site);
  for (std::size_t n = 0; n < needed; ++n) ranking.cost += ranked[n].first / static_cast<float>(needed);
  for (std::size_t n = 0; n < std::min<std::size_t>(kept, site.count); ++n)
    ranking.best |= static_cast<NeighbourSet>(1U << ranked[n].second);
  return ranking;
}

}  // namespace gyre
