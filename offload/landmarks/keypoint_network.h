// SPDX-License-Identifier: Apache-2.0
// A whole-body keypoint network (ONNX) run through OpenCV's DNN module.
#pragma once

#include "common/result/result.h"
#include "offload/landmarks/keypoint_layout.h"

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace gyre {

struct KeypointNetworkOptions {
  std::string layout = "133";
  int width = 288, height = 384;  // of the input, pixels
  // Input = (colour - mean) / deviation, 0 ... 255, in the order red, green, blue (or blue, green, red when !rgb).
  std::array<double, 3> mean = {123.675, 116.28, 103.53};
  std::array<double, 3> deviation = {58.395, 57.12, 57.375};
  bool rgb = true;

  Result<void> check() const;
};

struct Keypoint {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // of the whole picture
  double confidence = 0.0;                          // as the network gives it
  double deviation = 0.0;                           // half a cell of the network's output, pixels of the picture
};

class KeypointNetwork {
 public:
  // Errors: a file that is no network OpenCV can read.
  static Result<KeypointNetwork> load(const std::filesystem::path& file, const KeypointNetworkOptions& options);
  KeypointNetwork(KeypointNetwork&&) noexcept;
  KeypointNetwork& operator=(KeypointNetwork&&) noexcept;
  ~KeypointNetwork();

  const KeypointLayout& layout() const;

  // Keypoints of the person inside `box` of an 8-bit BGR picture. The box is grown by a quarter and to the input's
  // proportions and what of it lies outside of the picture is black. Outputs may be heat maps (1, keypoints, rows,
  // columns), read at the maximum with a quarter cell towards the higher neighbour (Newell et al., ECCV 2016), or SimCC
  // (two of (1, keypoints, bins), x first; Li et al., ECCV 2022), read at the maxima. The first cell's or bin's centre
  // is the first pixel's. Errors: another number of keypoints than the layout's, other outputs.
  Result<std::vector<Keypoint>> keypoints(const cv::Mat& picture, const cv::Rect2d& box) const;

 private:
  struct Net;
  explicit KeypointNetwork(std::unique_ptr<Net> net);
  std::unique_ptr<Net> net_;
};

}  // namespace gyre
