// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/view_selection.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gyre {
namespace {

struct ProxyPoint {
  Eigen::Vector3d position;
  Eigen::Vector3d normal;
};

// A stand-in for the unknown subject: the side and top of an upright cylinder inside the region.
std::vector<ProxyPoint> proxy_surface(const SubjectRegion& region) {
  constexpr int sectors = 24;
  constexpr int bands = 16;
  const Eigen::Vector3d centre = region.centre();
  const Eigen::Vector3d size = region.max - region.min;
  // As slim as a person's middle even in a wide box: a head camera may stand inside what the box alone would suggest.
  const double radius = std::min(0.25 * std::min(size.x(), size.z()), 0.07 * size.y());
  std::vector<ProxyPoint> points;
  for (int band = 0; band < bands; ++band) {
    const double y = region.min.y() + (band + 0.5) / bands * size.y();
    for (int sector = 0; sector < sectors; ++sector) {
      const double angle = 2 * std::numbers::pi * sector / sectors;
      const Eigen::Vector3d outward(std::sin(angle), 0.0, std::cos(angle));
      points.push_back({Eigen::Vector3d(centre.x(), y, centre.z()) + radius * outward, outward});
      if (band == bands - 1)
        points.push_back({points.back().position - 0.5 * radius * outward, Eigen::Vector3d::UnitY()});
    }
  }
  return points;
}

// What one view sees of the proxy.
struct Sighting {
  bool seen = false;
  Eigen::Vector3d direction;  // unit, from the point to the camera
  double pixels_per_metre = 0;
};

std::vector<Sighting> sightings(const StereoView& view, const std::vector<ProxyPoint>& points) {
  const Eigen::Vector3d eye = centre_of(view.cam_from_world);
  std::vector<Sighting> seen(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d to_eye = eye - points[i].position;
    if (to_eye.dot(points[i].normal) <= 0.0) continue;
    const auto pixel = view.camera.project(view.cam_from_world * points[i].position);
    if (!pixel || pixel->x() < 0 || pixel->y() < 0 || pixel->x() > view.width() || pixel->y() > view.height()) continue;
    const double distance = to_eye.norm();
    seen[i] = {true, to_eye / distance, view.camera.fx / distance};
  }
  return seen;
}

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

std::vector<std::vector<int>> select_neighbours(std::span<const StereoView> views, const SubjectRegion& region,
                                                const ViewSelectionOptions& options) {
  const std::vector<ProxyPoint> points = proxy_surface(region);
  std::vector<std::vector<Sighting>> seen;
  seen.reserve(views.size());
  for (const StereoView& view : views) seen.push_back(sightings(view, points));

  std::vector<std::vector<int>> neighbours(views.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    std::vector<std::pair<double, int>> ranked;
    for (std::size_t j = 0; j < views.size(); ++j) {
      const double score = i == j ? 0.0 : pair_score(seen[i], seen[j], options);
      if (score > 0.0) ranked.emplace_back(-score, static_cast<int>(j));
    }
    std::sort(ranked.begin(), ranked.end());
    if (ranked.size() > static_cast<std::size_t>(options.count)) ranked.resize(options.count);
    for (const auto& [score, j] : ranked) neighbours[i].push_back(j);
  }
  return neighbours;
}

}  // namespace gyre
