// SPDX-License-Identifier: Apache-2.0
#include "offload/report/overlays.h"

#include "common/bundle/bundle.h"
#include "common/render/rasterise.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace gyre {

namespace {

Camera scaled(const Camera& camera, int width, int height) {
  Camera small = camera;
  const double sx = static_cast<double>(width) / camera.width, sy = static_cast<double>(height) / camera.height;
  small.width = width;
  small.height = height;
  small.fx *= sx;
  small.cx *= sx;
  small.fy *= sy;
  small.cy *= sy;
  return small;
}

// In [-pi, pi].
double wrapped(double angle) {
  return std::remainder(angle, 2 * std::numbers::pi);
}

}  // namespace

std::vector<const ModelImage*> spread_views(const ColmapModel& model, const std::string& pass, double facing,
                                            std::size_t count) {
  std::vector<std::pair<double, const ModelImage*>> all;  // azimuth from where the subject looks
  for (const auto& [id, image] : model.images) {
    const auto name = parse_frame_name(image.name);
    if (!name || name->pass != pass) continue;
    const Eigen::Vector3d c = centre_of(image.cam_from_world);
    all.emplace_back(wrapped(std::atan2(c.x(), c.z()) - facing), &image);
  }
  std::vector<const ModelImage*> views;
  for (std::size_t i = 0; i < count; ++i) {
    const double wanted = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(count);
    const auto nearest = std::min_element(all.begin(), all.end(), [&](const auto& a, const auto& b) {
      return std::abs(wrapped(a.first - wanted)) < std::abs(wrapped(b.first - wanted));
    });
    if (nearest == all.end()) break;
    if (std::find(views.begin(), views.end(), nearest->second) == views.end()) views.push_back(nearest->second);
  }
  return views;
}

Overlay make_overlay(const ColmapModel& model, const ModelImage& image, const std::filesystem::path& photo,
                     const TriangleMesh& posed, const cv::Mat& texture, int height) {
  Overlay overlay{image.name, cv::imread(photo.string(), cv::IMREAD_COLOR), {}};
  if (overlay.photo.empty()) return overlay;
  const int width = std::max(1, height * overlay.photo.cols / overlay.photo.rows);
  cv::resize(overlay.photo, overlay.photo, {width, height}, 0, 0, cv::INTER_AREA);
  // Drawn at twice the size, so that its edges are as smooth as the photograph's.
  const Camera camera = scaled(model.camera_of(image), 2 * width, 2 * height);
  ShadeOptions shade;
  shade.lit = texture.empty();
  cv::Mat drawn = render(posed, texture, camera, image.cam_from_world, shade);
  const VisibilityBuffer seen = rasterise(posed.vertices, posed.triangles, camera, image.cam_from_world);
  cv::Mat behind;
  cv::resize(overlay.photo, behind, drawn.size(), 0, 0, cv::INTER_LINEAR);
  for (int y = 0; y < drawn.rows; ++y)
    for (int x = 0; x < drawn.cols; ++x)
      if (seen.triangle[seen.index(x, y)] < 0) drawn.at<cv::Vec3b>(y, x) = behind.at<cv::Vec3b>(y, x);
  cv::resize(drawn, overlay.avatar, {width, height}, 0, 0, cv::INTER_AREA);
  return overlay;
}

std::vector<Rgb> heat_colours(const std::vector<double>& distances_mm, double most_mm) {
  static constexpr std::array<std::array<double, 3>, 5> stops = {
      {{255, 255, 245}, {254, 217, 118}, {253, 141, 60}, {189, 0, 38}, {40, 0, 20}}};
  std::vector<Rgb> colours;
  for (const double distance : distances_mm) {
    if (!std::isfinite(distance)) {
      colours.push_back({150, 155, 165});
      continue;
    }
    const double at = std::clamp(distance / most_mm, 0.0, 1.0) * (stops.size() - 1);
    const auto low = std::min<std::size_t>(static_cast<std::size_t>(at), stops.size() - 2);
    Rgb colour;
    for (std::size_t k = 0; k < 3; ++k)
      colour[k] = static_cast<std::uint8_t>(std::lround(std::lerp(stops[low][k], stops[low + 1][k], at - low)));
    colours.push_back(colour);
  }
  return colours;
}

}  // namespace gyre
