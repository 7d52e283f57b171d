// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/depth_map.h"

#include "common/render/rasterise.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace gyre {

namespace {

// Two depths of neighbouring pixels that belong to different layers; infinity minus infinity is no edge.
bool is_edge(float a, float b, double jump) {
  return std::isinf(a) != std::isinf(b) || std::abs(a - b) > jump;
}

}  // namespace

DepthMap map_depth(const TriangleMesh& mesh, const Photo& photo, const SightOptions& options) {
  VisibilityBuffer buffer =
      rasterise(mesh.vertices, mesh.triangles, photo.camera, photo.cam_from_world, {.cull_back_faces = false});
  DepthMap map;
  map.width = buffer.width;
  map.height = buffer.height;
  map.depth = std::move(buffer.depth);
  map.edge_distance.assign(map.depth.size(), 0);

  cv::Mat inner(map.height, map.width, CV_8U, cv::Scalar(255));
  const auto mark = [&](int x0, int y0, int x1, int y1) {
    const float a = map.depth[static_cast<std::size_t>(y0) * map.width + x0];
    const float b = map.depth[static_cast<std::size_t>(y1) * map.width + x1];
    if (!is_edge(a, b, options.edge_jump)) return;
    inner.at<std::uint8_t>(y0, x0) = 0;
    inner.at<std::uint8_t>(y1, x1) = 0;
  };
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      if (x + 1 < map.width) mark(x, y, x + 1, y);
      if (y + 1 < map.height) mark(x, y, x, y + 1);
      if (std::isinf(map.depth[static_cast<std::size_t>(y) * map.width + x])) inner.at<std::uint8_t>(y, x) = 0;
    }
  }
  cv::Mat distance;
  cv::distanceTransform(inner, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      map.edge_distance[static_cast<std::size_t>(y) * map.width + x] =
          static_cast<std::uint8_t>(std::min(255.0F, distance.at<float>(y, x)));
    }
  }
  return map;
}

void add_edges(DepthMap& map, const DepthMap& other) {
  std::transform(map.edge_distance.begin(), map.edge_distance.end(), other.edge_distance.begin(),
                 map.edge_distance.begin(), [](std::uint8_t a, std::uint8_t b) { return std::min(a, b); });
}

std::optional<Sight> see(const Photo& photo, const DepthMap& map, const Eigen::Vector3d& point,
                         const Eigen::Vector3d& normal, const SightOptions& options) {
  const Eigen::Vector3d p = photo.cam_from_world * point;
  const auto pixel = photo.camera.project(p);
  if (!pixel) return std::nullopt;
  const int x = static_cast<int>(std::floor(pixel->x()));
  const int y = static_cast<int>(std::floor(pixel->y()));
  if (x < 1 || y < 1 || x >= map.width - 1 || y >= map.height - 1) return std::nullopt;
  const double cosine = (photo.cam_from_world.rotation * normal).dot(-p.normalized());
  if (cosine <= 0) return std::nullopt;

  const double pixels_per_metre = std::min(photo.camera.fx, photo.camera.fy) / p.z();
  const double slope = std::sqrt(std::max(0.0, 1.0 - cosine * cosine)) / (cosine * pixels_per_metre);
  const std::size_t i = static_cast<std::size_t>(y) * map.width + x;
  if (p.z() > map.depth[i] + options.depth_margin + options.slope_margin * slope) return std::nullopt;
  return Sight{*pixel, cosine, static_cast<double>(map.edge_distance[i]), pixels_per_metre};
}

}  // namespace gyre
