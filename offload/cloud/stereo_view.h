// SPDX-License-Identifier: Apache-2.0
// A keyframe made ready for dense matching: undistorted, at the working resolution, with a grey image pyramid.
#pragma once

#include "common/geometry/camera.h"
#include "common/geometry/pose.h"
#include "common/mesh/mesh.h"

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

namespace gyre {

// A grey image whose every texel holds the 2 x 2 block a bilinear lookup needs, so that one load serves a sample: the
// value at (x, y) in bits 0-7, (x + 1, y) in 8-15, (x, y + 1) in 16-23, (x + 1, y + 1) in 24-31, the border repeated.
struct QuadImage {
  int width = 0;
  int height = 0;
  std::vector<std::uint32_t> texels;  // row major

  float value(int x, int y) const {
    return static_cast<float>(texels[static_cast<std::size_t>(y) * width + x] & 0xFFU);
  }
};

// `grey`: CV_8UC1.
QuadImage make_quad_image(const cv::Mat& grey);

// One level of the pyramid. The matrix maps camera coordinates to array indices: index (0, 0) is the first pixel's
// centre, unlike Camera's pixels.
struct ImageLevel {
  QuadImage image;
  std::vector<Rgb> colours;  // of the image's size, row major
  Eigen::Matrix3d index_from_camera = Eigen::Matrix3d::Identity();
};

struct StereoView {
  std::string name;
  Camera camera;  // without distortion, of the working size
  Pose cam_from_world;
  std::vector<ImageLevel> levels;  // the first is the working size, each next one half of it

  int width() const { return camera.width; }
  int height() const { return camera.height; }
  std::size_t index(int x, int y) const { return static_cast<std::size_t>(y) * camera.width + x; }
};

// The pass of a keyframe's view; empty when its name is not a keyframe's.
std::string pass_of(const StereoView& view);

// Resamples `picture` (CV_8UC3 BGR, of the camera's size) to a pinhole view whose longer side is `long_side` pixels
// (never more than the picture's), averaging the source pixels each new pixel covers, and builds `level_count` levels.
// The grey value is the largest of the three channels: saturated cloth keeps its texture, which luma would dim.
StereoView make_stereo_view(std::string name, const cv::Mat& picture, const Camera& camera, const Pose& cam_from_world,
                            int long_side, int level_count);

}  // namespace gyre
