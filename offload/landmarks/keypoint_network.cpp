// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/keypoint_network.h"

#include <algorithm>
#include <cmath>
#include <opencv2/dnn.hpp>
#include <opencv2/imgproc.hpp>

namespace gyre {

struct KeypointNetwork::Net {
  mutable cv::dnn::Net net;
  KeypointNetworkOptions options;
  KeypointLayout layout;
};

namespace {

constexpr double grown = 1.25;  // of the box

// The affine map picture_from_input: scale and corner, with pixel centres at halves on both sides.
struct Crop {
  double scale = 1.0;  // picture pixels per input pixel
  Eigen::Vector2d corner = Eigen::Vector2d::Zero();
};

Crop crop_for(const cv::Rect2d& box, int width, int height) {
  Crop crop;
  crop.scale = grown * std::max({box.width / width, box.height / height, 1e-3});
  crop.corner = Eigen::Vector2d(box.x + box.width / 2, box.y + box.height / 2) -
                0.5 * crop.scale * Eigen::Vector2d(width, height);
  return crop;
}

// Input place (pixel centres at halves) and value of the largest entry of a heat map, moved by a quarter cell towards
// the higher neighbour.
std::pair<Eigen::Vector2d, double> heat_peak(const cv::Mat& heat, double stride_x, double stride_y) {
  double most = 0;
  cv::Point at;
  cv::minMaxLoc(heat, nullptr, &most, nullptr, &at);
  Eigen::Vector2d place(at.x, at.y);
  if (at.x > 0 && at.x + 1 < heat.cols) {
    const float d = heat.at<float>(at.y, at.x + 1) - heat.at<float>(at.y, at.x - 1);
    place.x() += d > 0 ? 0.25 : d < 0 ? -0.25 : 0;
  }
  if (at.y > 0 && at.y + 1 < heat.rows) {
    const float d = heat.at<float>(at.y + 1, at.x) - heat.at<float>(at.y - 1, at.x);
    place.y() += d > 0 ? 0.25 : d < 0 ? -0.25 : 0;
  }
  return {Eigen::Vector2d(place.x() * stride_x + 0.5, place.y() * stride_y + 0.5), most};
}

}  // namespace

Result<void> KeypointNetworkOptions::check() const {
  if (width < 8 || height < 8 || width > 4096 || height > 4096)
    return wrong_use("bad input size of the network", std::to_string(width) + "x" + std::to_string(height),
                     "give 8 to 4096 pixels");
  for (const double d : deviation)
    if (!(d > 0)) return wrong_use("a deviation of the network's input is not positive");
  if (const auto known = keypoint_layout(layout); !known) return tl::unexpected(known.error());
  return {};
}

KeypointNetwork::KeypointNetwork(std::unique_ptr<Net> net) : net_(std::move(net)) {}
KeypointNetwork::KeypointNetwork(KeypointNetwork&&) noexcept = default;
KeypointNetwork& KeypointNetwork::operator=(KeypointNetwork&&) noexcept = default;
KeypointNetwork::~KeypointNetwork() = default;

Result<KeypointNetwork> KeypointNetwork::load(const std::filesystem::path& file,
                                              const KeypointNetworkOptions& options) {
  if (const auto valid = options.check(); !valid) return tl::unexpected(valid.error());
  auto net = std::make_unique<Net>();
  try {
    net->net = cv::dnn::readNetFromONNX(file.string());
  } catch (const cv::Exception& e) {
    return wrong_use("cannot read the network", file.string() + " (" + e.err + ")", "give an ONNX file");
  }
  if (net->net.empty()) return wrong_use("the network has no layers", file.string(), "give an ONNX file");
  net->options = options;
  net->layout = *keypoint_layout(options.layout);
  return KeypointNetwork(std::move(net));
}

const KeypointLayout& KeypointNetwork::layout() const {
  return net_->layout;
}

Result<std::vector<Keypoint>> KeypointNetwork::keypoints(const cv::Mat& picture, const cv::Rect2d& box) const {
  const KeypointNetworkOptions& options = net_->options;
  const Crop crop = crop_for(box, options.width, options.height);
  // warpAffine counts pixel centres at whole numbers.
  const cv::Matx23d picture_from_input(crop.scale, 0, crop.corner.x() + 0.5 * crop.scale - 0.5, 0, crop.scale,
                                       crop.corner.y() + 0.5 * crop.scale - 0.5);
  cv::Mat input;
  cv::warpAffine(picture, input, picture_from_input, {options.width, options.height},
                 cv::INTER_LINEAR | cv::WARP_INVERSE_MAP, cv::BORDER_CONSTANT);
  if (options.rgb) cv::cvtColor(input, input, cv::COLOR_BGR2RGB);
  input.convertTo(input, CV_32FC3);
  cv::subtract(input, cv::Scalar(options.mean[0], options.mean[1], options.mean[2]), input);
  cv::divide(input, cv::Scalar(options.deviation[0], options.deviation[1], options.deviation[2]), input);

  std::vector<cv::Mat> outputs;
  try {
    net_->net.setInput(cv::dnn::blobFromImage(input));
    net_->net.forward(outputs, net_->net.getUnconnectedOutLayersNames());
  } catch (const cv::Exception& e) {
    return fail("the network does not run", e.err, "check the size of its input");
  }
  const int count = net_->layout.count;
  std::vector<Keypoint> keypoints(count);
  const auto finish = [&](int k, const Eigen::Vector2d& place, double confidence, double cell) {
    keypoints[k] = {crop.corner + crop.scale * place, confidence, 0.5 * cell * crop.scale};
  };
  if (outputs.size() == 1 && outputs[0].dims == 4 && outputs[0].size[1] == count) {
    const int rows = outputs[0].size[2], columns = outputs[0].size[3];
    const double stride_x = static_cast<double>(options.width) / columns,
                 stride_y = static_cast<double>(options.height) / rows;
    for (int k = 0; k < count; ++k) {
      const cv::Mat heat(rows, columns, CV_32F, outputs[0].ptr<float>(0, k));
      const auto [place, confidence] = heat_peak(heat, stride_x, stride_y);
      finish(k, place, confidence, std::max(stride_x, stride_y));
    }
    return keypoints;
  }
  if (outputs.size() == 2 && outputs[0].dims == 3 && outputs[1].dims == 3 && outputs[0].size[1] == count &&
      outputs[1].size[1] == count) {
    for (int k = 0; k < count; ++k) {
      Eigen::Vector2d place;
      double confidence = 0, cell = 0;
      for (int axis = 0; axis < 2; ++axis) {
        const int bins = outputs[axis].size[2];
        const float* values = outputs[axis].ptr<float>(0, k);
        const float* peak = std::max_element(values, values + bins);
        const double bin = static_cast<double>(axis == 0 ? options.width : options.height) / bins;
        place[axis] = static_cast<double>(peak - values) * bin + 0.5;
        confidence = axis == 0 ? *peak : std::min<double>(confidence, *peak);
        cell = std::max(cell, bin);
      }
      finish(k, place, confidence, cell);
    }
    return keypoints;
  }
  return fail("the network's outputs are neither heat maps nor SimCC of " + std::to_string(count) + " keypoints",
              std::to_string(outputs.size()) + " outputs", "give the layout the network was made for");
}

}  // namespace gyre
