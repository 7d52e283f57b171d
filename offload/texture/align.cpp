// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/align.h"

#include "common/parallel/parallel.h"
#include "offload/texture/common_picture.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

namespace gyre {

namespace {

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
    const auto [rendered, known, seen] =
        render_common(surface, photo, surface.depths[p], picture, grey, surface.limits.loose_edge_px);
    if (cv::countNonZero(known) == 0) return;
    cv::Mat flow;
    cv::DISOpticalFlow::create(cv::DISOpticalFlow::PRESET_FAST)->calc(rendered, grey, flow);
    const double before = misfit(photo, grey, rendered, known);
    photo.shift = grid_of(flow, rendered, known, surface.depths[p], options, surface.limits.loose_edge_px);
    photo.shift_grid = options.grid;
    if (misfit(photo, grey, rendered, known) >= before) photo.shift.release();
  });
}

}  // namespace gyre
