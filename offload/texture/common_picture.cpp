// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/common_picture.h"

#include "common/parallel/parallel.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <vector>

namespace gyre {

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

CommonView render_common(const PhotographedSurface& surface, const Photo& photo, const DepthMap& depth,
                         const cv::Mat& picture, const cv::Mat& grey, double margin) {
  CommonView view{grey.clone(), cv::Mat::zeros(grey.size(), CV_8U),
                  rasterise(surface.mesh.vertices, surface.mesh.triangles, photo.camera, photo.cam_from_world)};
  for (int y = 0; y < grey.rows; ++y) {
    for (int x = 0; x < grey.cols; ++x) {
      const std::size_t i = view.seen.index(x, y);
      if (view.seen.triangle[i] < 0 || depth.edge_distance[i] < margin) continue;
      const Eigen::Vector3i& corners = surface.mesh.uv_triangles[view.seen.triangle[i]];
      const Eigen::Vector2d w = view.seen.weights[i].cast<double>();
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
      view.picture.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(
          (1 - b) * ((1 - a) * corner[0][0] + a * corner[0][1]) + b * ((1 - a) * corner[1][0] + a * corner[1][1]));
      view.known.at<std::uint8_t>(y, x) = 255;
    }
  }
  return view;
}

}  // namespace gyre
