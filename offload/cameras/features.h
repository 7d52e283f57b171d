// SPDX-License-Identifier: Apache-2.0
// SIFT keypoints with RootSIFT descriptors of one picture.
#pragma once

#include "common/result/result.h"

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace gyre {

// 128 values of a unit vector times 512, rounded: whole numbers, so that a dot product is exact in any order of
// summation and matching gives the same result on every machine.
using Descriptor = std::array<std::int16_t, 128>;
inline constexpr int descriptor_norm = 512;

struct Features {
  int width = 0;
  int height = 0;
  std::vector<Eigen::Vector2d> keypoints;  // pixels, (0.5, 0.5) is the centre of the first; no place twice
  std::vector<float> sizes;                // standard deviation of the keypoint's Gaussian, pixels; per keypoint
  std::vector<Descriptor> descriptors;     // largest keypoints first
  std::vector<int> keypoint_of;            // per descriptor; a place with two orientations has two descriptors
  std::vector<std::array<std::uint8_t, 3>> colours;  // RGB, per keypoint
};

struct FeatureOptions {
  int max_features = 4000;           // descriptors kept, strongest response first
  double contrast_threshold = 0.02;  // of OpenCV's SIFT; lower finds more
  double edge_threshold = 10.0;
};

// RootSIFT (Arandjelovic and Zisserman, CVPR 2012, section 3): the L1-normalised SIFT vector's element-wise square
// root, which has unit L2 norm; here times 512.
Descriptor root_sift(const float* sift);

// Detects on an 8-bit BGR picture (Lowe, IJCV 2004). The result does not depend on threads.
Features detect_features(const cv::Mat& picture, const FeatureOptions& options = {});

// Reads a picture as it should be shown (EXIF orientation applied), BGR. Error when it is missing or no picture.
Result<cv::Mat> read_upright(const std::filesystem::path& file);

}  // namespace gyre
