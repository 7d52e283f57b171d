// SPDX-License-Identifier: Apache-2.0
#include "offload/landmarks/skin.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace gyre {

cv::Mat lab_of(const FaceMap& map, double sigma) {
  cv::Mat picture = map.mean / 255.0, lab;
  cv::GaussianBlur(picture, picture, {}, sigma / FaceMap::cell);
  cv::min(picture, 1.0, picture);
  cv::cvtColor(picture, lab, cv::COLOR_BGR2Lab);
  return lab;
}

cv::Vec3f median_colour(const FaceMap& map, const cv::Mat& lab, const Eigen::Vector2d& low,
                        const Eigen::Vector2d& high) {
  const cv::Point2d a = map.pixel({low.x(), high.y()}), b = map.pixel({high.x(), low.y()});
  const cv::Rect area = cv::Rect(cv::Point(a), cv::Point(b)) & cv::Rect(0, 0, lab.cols, lab.rows);
  std::array<std::vector<float>, 3> values;
  for (int r = area.y; r < area.y + area.height; ++r)
    for (int c = area.x; c < area.x + area.width; ++c) {
      const auto& colour = lab.at<cv::Vec3f>(r, c);
      if (colour[0] < 1) continue;
      for (int k = 0; k < 3; ++k) values[k].push_back(colour[k]);
    }
  cv::Vec3f median(0, 0, 0);
  for (int k = 0; k < 3; ++k) {
    if (values[k].empty()) continue;
    const auto middle = values[k].begin() + static_cast<std::ptrdiff_t>(values[k].size() / 2);
    std::nth_element(values[k].begin(), middle, values[k].end());
    median[k] = *middle;
  }
  return median;
}

}  // namespace gyre
