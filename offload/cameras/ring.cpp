// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/ring.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gyre {

namespace {

constexpr double turn = 2 * std::numbers::pi;

struct Stand {
  double azimuth = 0.0;   // in [0, 2 pi)
  double distance = 0.0;  // from the axis
};

Stand stand_of(const View& view) {
  const Eigen::Vector3d c = centre_of(view.cam_from_world);
  const double azimuth = std::atan2(c.x(), c.z());
  return {azimuth < 0 ? azimuth + turn : azimuth, std::hypot(c.x(), c.z())};
}

// Distance from which cameras count: a share of what nine in ten stay within, since one may have gone astray.
double least_distance(const Scene& scene, double share) {
  std::vector<double> distances;
  for (const View& view : scene.views)
    if (view.registered) distances.push_back(stand_of(view).distance);
  if (distances.empty()) return 0.0;
  const auto far = distances.begin() + static_cast<std::ptrdiff_t>(9 * (distances.size() - 1) / 10);
  std::nth_element(distances.begin(), far, distances.end());
  return share * *far;
}

// Calls use(from, to) for neighbours on the circle; the last one's `to` is a turn further.
template <class Use>
void for_each_step(const std::vector<double>& sorted, const Use& use) {
  for (std::size_t i = 0; i + 1 < sorted.size(); ++i) use(sorted[i], sorted[i + 1]);
  if (sorted.size() > 1) use(sorted.back(), sorted.front() + turn);
}

// Per step between neighbours, the points that views on both sides of its middle see.
std::vector<int> count_links(const Scene& scene, const std::vector<double>& azimuths, double least, double reach) {
  std::vector<double> middles;
  for_each_step(azimuths, [&](double from, double to) { middles.push_back(0.5 * (from + to)); });
  std::vector<int> links(middles.size(), 0);
  std::vector<double> seen_from;
  for (const Track& track : scene.tracks) {
    if (!track.triangulated) continue;
    seen_from.clear();
    for (const Observation& o : track.observations) {
      const Stand stand = o.used ? stand_of(scene.view_of(o)) : Stand{};
      if (o.used && stand.distance >= least) seen_from.push_back(stand.azimuth);
    }
    std::sort(seen_from.begin(), seen_from.end());
    for_each_step(seen_from, [&](double from, double to) {
      if (to - from > 2 * reach) return;
      for (std::size_t i = 0; i < middles.size(); ++i) {
        // A step over azimuth 0 meets middles on both sides of it.
        const double m = middles[i];
        if ((m > from && m < to) || (m + turn > from && m + turn < to)) ++links[i];
      }
    });
  }
  return links;
}

}  // namespace

Ring find_ring(const Scene& scene, const RingOptions& options) {
  const double least = least_distance(scene, options.close_up);
  std::vector<double> azimuths;
  for (const View& view : scene.views)
    if (view.registered && stand_of(view).distance >= least) azimuths.push_back(stand_of(view).azimuth);
  Ring ring;
  ring.largest_gap = turn;
  if (azimuths.size() < 3) return ring;
  std::sort(azimuths.begin(), azimuths.end());
  const std::vector<int> links = count_links(scene, azimuths, least, options.reach);
  ring.covered = turn;
  ring.largest_gap = 0.0;
  ring.closed = true;
  std::size_t step = 0;
  for_each_step(azimuths, [&](double from, double to) {
    const double gap = to - from;
    ring.largest_gap = std::max(ring.largest_gap, gap);
    if (gap > options.reach || links[step] < options.min_links) {
      ring.closed = false;
      ring.covered -= gap;
    }
    ++step;
  });
  ring.covered = std::max(0.0, ring.covered);
  return ring;
}

}  // namespace gyre
