// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/sight_lines.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gyre {

namespace {

enum class Level { unknown, open, blocked };

Level look_at_level(std::span<const SightLine> lines, double low, double high, double radius,
                    const SightLineOptions& options) {
  std::vector<int> through(static_cast<std::size_t>(options.sectors), 0), beside(through);
  for (const SightLine& line : lines) {
    if (line.height < low || line.height > high) continue;
    const int sector = static_cast<int>(line.azimuth / std::numbers::pi * options.sectors);
    const auto s = static_cast<std::size_t>(std::clamp(sector, 0, options.sectors - 1));
    const double distance = line.distance / radius;
    if (distance < options.through) ++through[s];
    if (distance > options.beside_from && distance < options.beside_to) ++beside[s];
  }
  const double width = options.through / (options.beside_to - options.beside_from);
  int told = 0, blocked = 0;
  for (std::size_t s = 0; s < through.size(); ++s) {
    const double expected = width * beside[s];
    if (expected < options.min_expected) continue;
    ++told;
    if (through[s] < options.max_share * expected) ++blocked;
  }
  if (told == 0) return Level::unknown;
  return blocked >= options.min_blocked * told ? Level::blocked : Level::open;
}

}  // namespace

std::vector<SightLine> lines_past_axis(const Scene& scene, const Similarity& upright, double radius,
                                       const SightLineOptions& options) {
  std::vector<SightLine> lines;
  for (const Track& track : scene.tracks) {
    if (!track.triangulated || track.used_count() < 3) continue;
    const Eigen::Vector3d point = upright * track.point;
    for (const Observation& o : track.observations) {
      if (!o.used) continue;
      const Eigen::Vector3d centre = upright * centre_of(scene.view_of(o).cam_from_world);
      const Eigen::Vector3d way = point - centre;
      const double length = std::hypot(way.x(), way.z());
      if (length <= 0) continue;
      const double t = -(centre.x() * way.x() + centre.z() * way.z()) / (length * length);
      if (t <= 0 || (1 - t) * length < options.behind * radius) continue;
      const Eigen::Vector3d passing = centre + t * way;
      double azimuth = std::atan2(way.x(), way.z());
      if (azimuth < 0) azimuth += std::numbers::pi;
      lines.push_back({passing.y(), std::hypot(passing.x(), passing.z()), azimuth});
    }
  }
  return lines;
}

bool is_solid(std::span<const SightLine> lines, double low, double high, double radius,
              const SightLineOptions& options) {
  const int levels = std::max(1, static_cast<int>(std::ceil((high - low) / (options.level * radius))));
  const double step = (high - low) / levels;
  int blocked = 0;
  for (int i = 0; i < levels; ++i) {
    const Level level = look_at_level(lines, low + i * step, low + (i + 1) * step, radius, options);
    if (level == Level::open) return false;
    if (level == Level::blocked) ++blocked;
  }
  return 2 * blocked >= levels;
}

}  // namespace gyre
