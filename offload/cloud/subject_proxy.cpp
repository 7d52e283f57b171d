// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/subject_proxy.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gyre {

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

}  // namespace gyre
