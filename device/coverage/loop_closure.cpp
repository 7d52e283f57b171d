// SPDX-License-Identifier: Apache-2.0
#include "device/coverage/loop_closure.h"

#include "device/analysis/relative_pose.h"

#include <opencv2/features2d.hpp>

namespace gyre {

namespace {

void detect(const cv::Mat& luma, std::vector<cv::KeyPoint>& points, cv::Mat& descriptors) {
  constexpr int most = 500;
  constexpr float scale = 1.2F;
  constexpr int levels = 4;
  constexpr int edge = 15;  // half a patch: the pictures are small
  const auto orb = cv::ORB::create(most, scale, levels, edge, 0, 2, cv::ORB::HARRIS_SCORE, 2 * edge + 1, 12);
  orb->detectAndCompute(luma, cv::noArray(), points, descriptors);
}

Eigen::Vector2d pixel_of(const cv::KeyPoint& point) {
  return {point.pt.x + 0.5, point.pt.y + 0.5};
}

}  // namespace

RememberedView::RememberedView(const Camera& camera, const cv::Mat& luma)
    : camera_(camera.scaled(static_cast<double>(luma.cols) / camera.width)) {
  detect(luma, points_, descriptors_);
}

std::optional<Eigen::Quaterniond> RememberedView::turn_to(const cv::Mat& luma) const {
  constexpr float ratio = 0.8F;  // Lowe, IJCV 2004
  constexpr double enough = 25;  // matches that agree
  std::vector<cv::KeyPoint> points;
  cv::Mat descriptors;
  detect(luma, points, descriptors);
  if (descriptors.rows < enough || descriptors_.rows < enough) return std::nullopt;
  std::vector<std::vector<cv::DMatch>> pairs;
  cv::BFMatcher(cv::NORM_HAMMING).knnMatch(descriptors_, descriptors, pairs, 2);
  std::vector<Eigen::Vector2d> then, now;
  for (const std::vector<cv::DMatch>& pair : pairs) {
    if (pair.size() < 2 || pair[0].distance > ratio * pair[1].distance) continue;
    then.push_back(pixel_of(points_[static_cast<std::size_t>(pair[0].queryIdx)]));
    now.push_back(pixel_of(points[static_cast<std::size_t>(pair[0].trainIdx)]));
  }
  const std::optional<RelativePose> pose =
      relative_pose(then, now, camera_, {.noise = 0.7, .least_inliers = enough, .min_share = 0.5});
  if (!pose) return std::nullopt;
  return pose->b_from_a.rotation;
}

}  // namespace gyre
