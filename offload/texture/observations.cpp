// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/observations.h"

#include "common/parallel/parallel.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <optional>

namespace gyre {

namespace {

struct TriangleSight {
  std::int32_t triangle;
  Observation observation;
};

// Mean squared Laplacian over 7 x 7 pixels: how much fine detail a place of the picture has.
cv::Mat laplacian_energy(const cv::Mat& image) {
  cv::Mat grey, laplacian, energy;
  cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  cv::Laplacian(grey, laplacian, CV_32F);
  cv::multiply(laplacian, laplacian, energy);
  cv::boxFilter(energy, energy, CV_32F, {7, 7});
  return energy;
}

// The triangle's middle and three points near its corners stand for all of it: triangles are small against the depth
// edges the margins keep away from.
std::optional<Observation> observe_triangle(const PhotographedSurface& surface, std::size_t triangle, int photo,
                                            const cv::Mat& energy) {
  const std::vector<Eigen::Vector3d>& vertices = surface.mesh.vertices;
  const Eigen::Vector3i& corners = surface.mesh.triangles[triangle];
  const Eigen::Vector3d middle = (vertices[corners[0]] + vertices[corners[1]] + vertices[corners[2]]) / 3.0;
  Observation observation{.photo = photo, .quality = ViewQuality::strict, .colour = Eigen::Vector3f::Zero()};
  double edge = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 4; ++k) {
    const Eigen::Vector3d point = k == 3 ? middle : Eigen::Vector3d(0.3 * middle + 0.7 * vertices[corners[k]]);
    const auto [quality, sight] = surface.look(photo, point, surface.normals[triangle]);
    if (quality == ViewQuality::none) return std::nullopt;
    observation.quality = std::min(observation.quality, quality);
    observation.colour += 0.25F * sample_raw(surface.photos[photo], sight.pixel);
    edge = std::min(edge, sight.edge_distance / sight.pixels_per_metre);
    if (k < 3) continue;
    // Full trust from three margins away.
    const double clear = std::clamp(edge / (3.0 * surface.limits.strict_edge), 0.2, 1.0);
    observation.score = static_cast<float>(sight.cosine * sight.pixels_per_metre * clear);
    const float e = energy.at<float>(static_cast<int>(sight.pixel.y()), static_cast<int>(sight.pixel.x()));
    observation.detail = std::log(e + 4.0F);  // 4: a sensor's noise, so that flat places count little
  }
  return observation;
}

}  // namespace

ViewQuality quality_of(const Sight& sight, const ViewLimits& limits) {
  if (sight.cosine < limits.loose_cosine || sight.edge_distance < limits.loose_edge_px) return ViewQuality::none;
  const bool clear = sight.edge_distance >= limits.strict_edge * sight.pixels_per_metre;
  return clear && sight.cosine >= limits.strict_cosine ? ViewQuality::strict : ViewQuality::loose;
}

PhotographedSurface::Look PhotographedSurface::look(int photo, const Eigen::Vector3d& point,
                                                    const Eigen::Vector3d& normal) const {
  const auto seen = see(photos[photo], depths[photo], point, normal, sight);
  if (!seen) return {};
  return {quality_of(*seen, limits), *seen};
}

ObservationTable observe(const PhotographedSurface& surface, std::span<const std::uint8_t> skip, int threads) {
  std::vector<std::vector<TriangleSight>> by_photo(surface.photos.size());
  parallel_for(by_photo.size(), threads, [&](std::size_t p) {
    const cv::Mat energy = laplacian_energy(surface.photos[p].image);
    for (std::size_t t = 0; t < surface.mesh.triangles.size(); ++t) {
      if (skip[t]) continue;
      const auto seen = observe_triangle(surface, t, static_cast<int>(p), energy);
      if (seen) by_photo[p].push_back({static_cast<std::int32_t>(t), *seen});
    }
  });

  ObservationTable table;
  table.start.assign(surface.mesh.triangles.size() + 1, 0);
  for (const auto& sights : by_photo) {
    for (const TriangleSight& s : sights) ++table.start[s.triangle + 1];
  }
  for (std::size_t t = 0; t < surface.mesh.triangles.size(); ++t) table.start[t + 1] += table.start[t];
  table.all.resize(table.start.back());
  std::vector<std::size_t> next(table.start.begin(), table.start.end() - 1);
  for (const auto& sights : by_photo) {
    for (const TriangleSight& s : sights) table.all[next[s.triangle]++] = s.observation;
  }
  return table;
}

}  // namespace gyre
