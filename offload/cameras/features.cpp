// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/features.h"

#include <opencv2/features2d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <tuple>

namespace gyre {

namespace {

// OpenCV doubles the picture with pixel centres at half-integers but halves the found coordinates as if they were at
// integers, which moves every keypoint by a quarter of a pixel; its pixel centres are at integers, ours at halves.
constexpr double pixel_from_opencv_sift = 0.5 - 0.25;

bool comes_first(const cv::KeyPoint& a, const cv::KeyPoint& b) {
  return std::tie(b.size, a.pt.y, a.pt.x, a.angle, b.response) < std::tie(a.size, b.pt.y, b.pt.x, b.angle, a.response);
}

}  // namespace

Descriptor root_sift(const float* sift) {
  double sum = 0.0;
  for (int i = 0; i < 128; ++i) sum += sift[i];
  Descriptor root{};
  if (sum <= 0.0) return root;
  for (std::size_t i = 0; i < 128; ++i)
    root[i] = static_cast<std::int16_t>(std::lround(descriptor_norm * std::sqrt(sift[i] / sum)));
  return root;
}

Features detect_features(const cv::Mat& picture, const FeatureOptions& options) {
  cv::Mat grey;
  cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
  Features features;
  features.width = grey.cols;
  features.height = grey.rows;
  std::vector<cv::KeyPoint> found;
  const auto sift =
      cv::SIFT::create(options.max_features, 3, options.contrast_threshold, options.edge_threshold, 1.6, CV_32F);
  cv::Mat raw;
  // In one call, because two would build the pyramid twice.
  sift->detectAndCompute(grey, cv::noArray(), found, raw);
  std::vector<int> order(found.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    return comes_first(found[static_cast<std::size_t>(a)], found[static_cast<std::size_t>(b)]);
  });

  std::map<std::pair<float, float>, int> at_place;
  for (const int i : order) {
    const cv::KeyPoint& keypoint = found[static_cast<std::size_t>(i)];
    const auto [place, is_new] =
        at_place.try_emplace({keypoint.pt.x, keypoint.pt.y}, static_cast<int>(features.keypoints.size()));
    if (is_new) {
      features.keypoints.emplace_back(keypoint.pt.x + pixel_from_opencv_sift, keypoint.pt.y + pixel_from_opencv_sift);
      features.sizes.push_back(0.5F * keypoint.size);
      const auto bgr = picture.at<cv::Vec3b>(std::clamp(cvRound(keypoint.pt.y), 0, picture.rows - 1),
                                             std::clamp(cvRound(keypoint.pt.x), 0, picture.cols - 1));
      features.colours.push_back({bgr[2], bgr[1], bgr[0]});
    }
    features.keypoint_of.push_back(place->second);
    features.descriptors.push_back(root_sift(raw.ptr<float>(i)));
  }
  return features;
}

Result<cv::Mat> read_upright(const std::filesystem::path& file) {
  try {
    cv::Mat picture = cv::imread(file.string(), cv::IMREAD_COLOR);
    if (!picture.empty()) return picture;
  } catch (const cv::Exception&) {
    // A damaged file is the same failure as a missing one to the caller.
  }
  return fail("cannot read picture", file.string(), "remove the damaged file or record again");
}

}  // namespace gyre
