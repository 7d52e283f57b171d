// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/stereo_view.h"

#include "common/bundle/bundle.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <opencv2/core.hpp>
#include <utility>

namespace gyre {
namespace {

Eigen::Matrix3d index_matrix(const Camera& camera) {
  Eigen::Matrix3d k = Eigen::Matrix3d::Identity();
  k(0, 0) = camera.fx;
  k(1, 1) = camera.fy;
  k(0, 2) = camera.cx - 0.5;
  k(1, 2) = camera.cy - 0.5;
  return k;
}

Eigen::Vector3f sample_bilinear(const cv::Mat& picture, const Eigen::Vector2d& pixel) {
  const double x = std::clamp(pixel.x() - 0.5, 0.0, picture.cols - 1.0);
  const double y = std::clamp(pixel.y() - 0.5, 0.0, picture.rows - 1.0);
  const int x0 = static_cast<int>(x);
  const int y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, picture.cols - 1);
  const auto fx = static_cast<float>(x - x0);
  const auto fy = static_cast<float>(y - y0);
  const auto* row0 = picture.ptr<cv::Vec3b>(y0);
  const auto* row1 = picture.ptr<cv::Vec3b>(std::min(y0 + 1, picture.rows - 1));
  Eigen::Vector3f mixed;
  for (int c = 0; c < 3; ++c) {
    const float top = static_cast<float>(row0[x0][c]) * (1 - fx) + static_cast<float>(row0[x1][c]) * fx;
    const float bottom = static_cast<float>(row1[x0][c]) * (1 - fx) + static_cast<float>(row1[x1][c]) * fx;
    mixed[c] = top * (1 - fy) + bottom * fy;
  }
  return mixed;
}

// Averages 2 x 2 blocks; an odd last row or column is left out.
cv::Mat halved(const cv::Mat& picture) {
  cv::Mat half(picture.rows / 2, picture.cols / 2, CV_8UC3);
  for (int y = 0; y < half.rows; ++y) {
    const auto* a = picture.ptr<cv::Vec3b>(2 * y);
    const auto* b = picture.ptr<cv::Vec3b>(2 * y + 1);
    auto* out = half.ptr<cv::Vec3b>(y);
    for (int x = 0; x < half.cols; ++x) {
      for (int c = 0; c < 3; ++c) {
        out[x][c] = static_cast<std::uint8_t>((a[2 * x][c] + a[2 * x + 1][c] + b[2 * x][c] + b[2 * x + 1][c] + 2) / 4);
      }
    }
  }
  return half;
}

ImageLevel make_level(const cv::Mat& picture, const Camera& camera) {
  ImageLevel level;
  level.index_from_camera = index_matrix(camera);
  cv::Mat grey(picture.rows, picture.cols, CV_8UC1);
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      const cv::Vec3b& bgr = picture.at<cv::Vec3b>(y, x);
      level.colours.emplace_back(bgr[2], bgr[1], bgr[0]);
      grey.at<std::uint8_t>(y, x) = std::max({bgr[0], bgr[1], bgr[2]});
    }
  }
  level.image = make_quad_image(grey);
  return level;
}

}  // namespace

QuadImage make_quad_image(const cv::Mat& grey) {
  assert(grey.type() == CV_8UC1);
  QuadImage quads{grey.cols, grey.rows, {}};
  quads.texels.resize(static_cast<std::size_t>(grey.cols) * grey.rows);
  for (int y = 0; y < grey.rows; ++y) {
    const auto* row0 = grey.ptr<std::uint8_t>(y);
    const auto* row1 = grey.ptr<std::uint8_t>(std::min(y + 1, grey.rows - 1));
    std::uint32_t* out = quads.texels.data() + static_cast<std::size_t>(y) * grey.cols;
    for (int x = 0; x < grey.cols; ++x) {
      const int x1 = std::min(x + 1, grey.cols - 1);
      out[x] = static_cast<std::uint32_t>(row0[x]) | static_cast<std::uint32_t>(row0[x1]) << 8U |
               static_cast<std::uint32_t>(row1[x]) << 16U | static_cast<std::uint32_t>(row1[x1]) << 24U;
    }
  }
  return quads;
}

std::string pass_of(const StereoView& view) {
  const auto name = parse_frame_name(view.name);
  return name ? name->pass : std::string();
}

StereoView make_stereo_view(std::string name, const cv::Mat& picture, const Camera& camera, const Pose& cam_from_world,
                            int long_side, int level_count) {
  assert(picture.type() == CV_8UC3 && picture.cols == camera.width && picture.rows == camera.height);
  const double factor = std::min(1.0, static_cast<double>(long_side) / std::max(camera.width, camera.height));
  StereoView view{std::move(name), camera.without_distortion().scaled(factor), cam_from_world, {}};

  const Camera& target = view.camera;
  const int taps = static_cast<int>(std::ceil(static_cast<double>(camera.width) / target.width - 1e-6));
  cv::Mat resampled(target.height, target.width, CV_8UC3);
  for (int y = 0; y < target.height; ++y) {
    for (int x = 0; x < target.width; ++x) {
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      for (int tap = 0; tap < taps * taps; ++tap) {
        const double u = x + (tap % taps + 0.5) / taps;
        const int row = tap / taps;
        const double v = y + (row + 0.5) / taps;
        sum += sample_bilinear(picture, camera.pixel_from_normalised(
                                            Eigen::Vector2d((u - target.cx) / target.fx, (v - target.cy) / target.fy)));
      }
      auto& bgr = resampled.at<cv::Vec3b>(y, x);
      for (int c = 0; c < 3; ++c) {
        bgr[c] = cv::saturate_cast<std::uint8_t>(sum[c] / static_cast<float>(taps * taps));
      }
    }
  }

  Camera level_camera = target;
  for (int level = 0; level < level_count; ++level) {
    view.levels.push_back(make_level(resampled, level_camera));
    if (resampled.cols < 4 || resampled.rows < 4) break;
    resampled = halved(resampled);
    level_camera.fx /= 2;
    level_camera.fy /= 2;
    level_camera.cx /= 2;
    level_camera.cy /= 2;
  }
  return view;
}

}  // namespace gyre
