// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/align.h"

#include "common/parallel/parallel.h"
#include "common/render/rasterise.h"
#include "offload/texture/atlas.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

namespace gyre {

namespace {

// The texture that the photographs agree on, grey; -1 where fewer than two see the surface.
cv::Mat common_picture(const PhotographedSurface& surface, const ObservationTable& table, const Atlas& atlas,
                       std::size_t views, int threads) {
  std::vector<std::vector<Observation>> best(surface.mesh.triangles.size());
  for (std::size_t t = 0; t < best.size(); ++t) {
    const auto seen = table.of(t);
    best[t].assign(seen.begin(), seen.end());
    std::stable_sort(best[t].begin(), best[t].end(), [](const Observation& a, const Observation& b) {
      return std::pair(a.quality, a.score) > std::pair(b.quality, b.score);
    });
    if (best[t].size() > views) best[t].resize(views);
    if (best[t].size() < 2) best[t].clear();
  }
  cv::Mat picture(atlas.size, atlas.size, CV_32F, cv::Scalar(-1));
  parallel_for(atlas.size, threads, [&](std::size_t y) {
    for (int x = 0; x < atlas.size; ++x) {
      const std::size_t i = y * atlas.size + x;
      if (atlas.triangle[i] < 0 || best[atlas.triangle[i]].empty()) continue;
      const Eigen::Vector3d point = texel_point(surface.mesh, atlas, i);
      float sum = 0, total = 0;
      for (const Observation& o : best[atlas.triangle[i]]) {
        const Photo& photo = surface.photos[o.photo];
        const auto pixel = photo.camera.project(photo.cam_from_world * point);
        if (!pixel) continue;
        sum += o.score * sample(photo, *pixel).dot(Eigen::Vector3f(0.114F, 0.587F, 0.299F));
        total += o.score;
      }
      if (total > 0) picture.at<float>(static_cast<int>(y), x) = sum / total;
    }
  });
  return picture;
}

cv::Mat grey_of(const Photo& photo) {
  cv::Mat grey(photo.image.size(), CV_8U);
  for (int y = 0; y < grey.rows; ++y) {
    for (int x = 0; x < grey.cols; ++x) {
      const cv::Vec3b& c = photo.image.at<cv::Vec3b>(y, x);
      const Eigen::Vector3f even = photo.tone.apply(Eigen::Vector3f(c[0], c[1], c[2]));
      grey.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(even.dot(Eigen::Vector3f(0.114F, 0.587F, 0.299F)));
    }
  }
  return grey;
}

// The common picture as the photograph's camera sees it, over `grey` where it sees nothing of it; `known`: 255 where it
// does.
cv::Mat render_common(const PhotographedSurface& surface, const Photo& photo, const DepthMap& depth,
                      const cv::Mat& picture, const cv::Mat& grey, cv::Mat& known) {
  const VisibilityBuffer seen =
      rasterise(surface.mesh.vertices, surface.mesh.triangles, photo.camera, photo.cam_from_world);
  cv::Mat rendered = grey.clone();
  known = cv::Mat::zeros(grey.size(), CV_8U);
  for (int y = 0; y < grey.rows; ++y) {
    for (int x = 0; x < grey.cols; ++x) {
      const std::size_t i = seen.index(x, y);
      if (seen.triangle[i] < 0 || depth.edge_distance[i] < surface.limits.loose_edge_px) continue;
      const Eigen::Vector3i& corners = surface.mesh.uv_triangles[seen.triangle[i]];
      const Eigen::Vector2d w = seen.weights[i].cast<double>();
      const Eigen::Vector2d uv = (1 - w.x() - w.y()) * surface.mesh.uv[corners[0]] +
                                 w.x() * surface.mesh.uv[corners[1]] + w.y() * surface.mesh.uv[corners[2]];
      const Eigen::Vector2d at = uv * picture.cols - Eigen::Vector2d(0.5, 0.5);
      const auto u = static_cast<int>(std::floor(at.x()));
      const auto v = static_cast<int>(std::floor(at.y()));
      if (u < 0 || v < 0 || u + 1 >= picture.cols || v + 1 >= picture.rows) continue;
      const float corner[2][2] = {{picture.at<float>(v, u), picture.at<float>(v, u + 1)},
                                  {picture.at<float>(v + 1, u), picture.at<float>(v + 1, u + 1)}};
      if (std::min({corner[0][0], corner[0][1], corner[1][0], corner[1][1]}) < 0) continue;
      const auto a = static_cast<float>(at.x() - u);
      const auto b = static_cast<float>(at.y() - v);
      rendered.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(
          (1 - b) * ((1 - a) * corner[0][0] + a * corner[0][1]) + b * ((1 - a) * corner[1][0] + a * corner[1][1]));
      known.at<std::uint8_t>(y, x) = 255;
    }
  }
  return rendered;
}

// Weighted mean of the flow around every node; towards no shift where the weights are small.
cv::Mat grid_of(const cv::Mat& flow, const cv::Mat& rendered, const cv::Mat& known, const DepthMap& depth,
                const AlignOptions& options, double edge_margin) {
  cv::Mat dx, dy;
  cv::Sobel(rendered, dx, CV_32F, 1, 0, 3, 0.125);
  cv::Sobel(rendered, dy, CV_32F, 0, 1, 3, 0.125);
  cv::Mat weight = dx.mul(dx) + dy.mul(dy);
  weight.setTo(0, known == 0);
  cv::min(weight, 50 * options.least_detail, weight);  // an edge of light and dark is not worth more than that
  cv::Mat weights[2] = {weight, weight};
  cv::Mat both;
  cv::merge(weights, 2, both);
  cv::Mat sum, total;
  cv::GaussianBlur(flow.mul(both), sum, {0, 0}, options.grid);
  cv::GaussianBlur(weight, total, {0, 0}, options.grid);
  cv::Mat grid(flow.rows / options.grid + 2, flow.cols / options.grid + 2, CV_32FC2);
  for (int j = 0; j < grid.rows; ++j) {
    for (int i = 0; i < grid.cols; ++i) {
      const int y = std::min(j * options.grid, flow.rows - 1);
      const int x = std::min(i * options.grid, flow.cols - 1);
      const float divisor = total.at<float>(y, x) + static_cast<float>(options.least_detail);
      cv::Vec2f shift = sum.at<cv::Vec2f>(y, x) / divisor;
      const double clear = depth.edge_distance[static_cast<std::size_t>(y) * depth.width + x] - edge_margin;
      const double most = std::clamp(clear, 0.0, options.most);
      const double length = cv::norm(shift);
      if (length > most) shift *= static_cast<float>(most / length);
      grid.at<cv::Vec2f>(j, i) = shift;
    }
  }
  return grid;
}

// Mean squared difference between the common picture and the photograph as it is sampled now.
double misfit(const Photo& photo, const cv::Mat& grey, const cv::Mat& rendered, const cv::Mat& known) {
  cv::Mat places(grey.size(), CV_32FC2);
  for (int y = 0; y < grey.rows; ++y) {
    for (int x = 0; x < grey.cols; ++x) {
      const Eigen::Vector2d p = shifted(photo, {x + 0.5, y + 0.5});
      places.at<cv::Vec2f>(y, x) = {static_cast<float>(p.x() - 0.5), static_cast<float>(p.y() - 0.5)};
    }
  }
  cv::Mat moved;
  cv::remap(grey, moved, places, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return cv::norm(moved, rendered, cv::NORM_L2SQR, known);
}

}  // namespace

void align_photos(const PhotographedSurface& surface, const ObservationTable& table, const AlignOptions& options,
                  int threads, std::span<Photo> photos) {
  const Atlas atlas = map_atlas(surface.mesh.uv, surface.mesh.uv_triangles, options.size, 1);
  const cv::Mat picture = common_picture(surface, table, atlas, static_cast<std::size_t>(options.views), threads);
  parallel_for(photos.size(), threads, [&](std::size_t p) {
    Photo& photo = photos[p];
    if (std::min(photo.image.rows, photo.image.cols) < 4 * options.grid) return;
    const cv::Mat grey = grey_of(photo);
    cv::Mat known, flow;
    const cv::Mat rendered = render_common(surface, photo, surface.depths[p], picture, grey, known);
    if (cv::countNonZero(known) == 0) return;
    cv::DISOpticalFlow::create(cv::DISOpticalFlow::PRESET_FAST)->calc(rendered, grey, flow);
    const double before = misfit(photo, grey, rendered, known);
    photo.shift = grid_of(flow, rendered, known, surface.depths[p], options, surface.limits.loose_edge_px);
    photo.shift_grid = options.grid;
    if (misfit(photo, grey, rendered, known) >= before) photo.shift.release();
  });
}

}  // namespace gyre
