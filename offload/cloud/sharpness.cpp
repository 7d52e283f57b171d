// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/sharpness.h"

#include "common/parallel/parallel.h"
#include "offload/cloud/subject_proxy.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <tuple>

namespace gyre {
namespace {

constexpr double middle = 0.4;  // of the region's width: the trunk and little of the room beside it

// Mean squared gradient of a level where rays meet the region; noise of a grey level taken off.
double gradient_energy(const StereoView& view, std::size_t level, const SubjectRegion& region) {
  const ImageLevel& at = view.levels[level];
  const Pose world_from_cam = view.cam_from_world.inverse();
  const Eigen::Matrix3d direction = world_from_cam.rotation.toRotationMatrix() * at.index_from_camera.inverse();
  double sum = 0;
  std::size_t count = 0;
  for (int y = 0; y + 1 < at.image.height; ++y) {
    for (int x = 0; x + 1 < at.image.width; ++x) {
      if (!intersect(region, world_from_cam.translation, direction * Eigen::Vector3d(x, y, 1))) continue;
      const float here = at.image.value(x, y);
      const float dx = at.image.value(x + 1, y) - here;
      const float dy = at.image.value(x, y + 1) - here;
      sum += static_cast<double>(dx * dx + dy * dy);
      ++count;
    }
  }
  return count == 0 ? 0.0 : std::max(0.0, sum / static_cast<double>(count) - 4.0);
}

}  // namespace

std::vector<double> relative_sharpness(std::span<const StereoView> views, const SubjectRegion& region, int threads) {
  SubjectRegion trunk = region;
  for (const int axis : {0, 2}) {
    const double half = 0.5 * middle * (region.max[axis] - region.min[axis]);
    trunk.min[axis] = region.centre()[axis] - half;
    trunk.max[axis] = region.centre()[axis] + half;
  }
  std::vector<double> detail(views.size(), 0.0);
  parallel_for(views.size(), threads, [&](std::size_t i) {
    if (views[i].levels.size() < 2) return;
    const double coarse = gradient_energy(views[i], 1, trunk);
    if (coarse > 0) detail[i] = gradient_energy(views[i], 0, trunk) / coarse;
  });
  std::map<std::tuple<std::string, int, int>, std::vector<double>> passes;
  const auto pass = [&](std::size_t i) { return std::tuple(pass_of(views[i]), views[i].width(), views[i].height()); };
  for (std::size_t i = 0; i < views.size(); ++i)
    if (detail[i] > 0) passes[pass(i)].push_back(detail[i]);
  for (auto& [name, details] : passes) std::sort(details.begin(), details.end());
  std::vector<double> sharpness(views.size(), 1.0);
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (!(detail[i] > 0)) continue;
    const std::vector<double>& details = passes[pass(i)];
    sharpness[i] = detail[i] / details[details.size() / 2];
  }
  return sharpness;
}

std::vector<char> views_to_use(std::span<const StereoView> views, const SubjectRegion& region,
                               const std::vector<double>& sharpness, const BlurOptions& options) {
  const std::vector<ProxyPoint> points = proxy_surface(region);
  std::vector<std::vector<Sighting>> seen;
  for (const StereoView& view : views) seen.push_back(sightings(view, points));
  const double near = std::cos(options.max_angle_deg * std::numbers::pi / 180.0);
  // Sharp views that look at a place as the given one does, or at all where that one looks along the surface.
  const auto others = [&](std::size_t view, std::size_t p) {
    const Eigen::Vector3d& direction = seen[view][p].direction;
    const bool along = direction.dot(points[p].normal) < 0.5;
    int count = 0;
    for (std::size_t j = 0; j < views.size(); ++j) {
      if (sharpness[j] < options.sharp || !seen[j][p].seen) continue;
      count += along || seen[j][p].direction.dot(direction) > near ? 1 : 0;
    }
    return count;
  };
  std::vector<char> use(views.size(), 1);
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (sharpness[i] >= options.sharp) continue;
    use[i] = 0;
    for (std::size_t p = 0; p < points.size(); ++p)
      if (seen[i][p].seen && others(i, p) < options.replacements) use[i] = 1;
  }
  return use;
}

}  // namespace gyre
