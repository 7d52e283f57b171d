// SPDX-License-Identifier: Apache-2.0
#include "device/analysis/point_tracks.h"

#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

namespace gyre {

void PointTracks::add(const cv::Mat& luma) {
  const cv::Size window(options_.window, options_.window);
  pyramid_.clear();
  cv::buildOpticalFlowPyramid(luma, pyramid_, window, options_.levels);
  luma_ = luma;
  if (positions_.empty()) return;
  // Always from where the last refill saw the points: hops from frame to frame would add up to a slide.
  std::vector<cv::Point2f> there = positions_, back;
  std::vector<unsigned char> found, returned;
  std::vector<float> error;
  const cv::TermCriteria until(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 10, 0.03);
  cv::calcOpticalFlowPyrLK(view_pyramid_, pyramid_, view_positions_, there, found, error, window, options_.levels,
                           until, cv::OPTFLOW_USE_INITIAL_FLOW);
  // The way back is looked for around where it should end, so that the upper levels, where it would be found from far
  // away, can be left out; a point that is not the same one leads elsewhere from there, too.
  constexpr int levels_back = 1;
  back = view_positions_;
  cv::calcOpticalFlowPyrLK(pyramid_, view_pyramid_, there, back, returned, error, window, levels_back, until,
                           cv::OPTFLOW_USE_INITIAL_FLOW);
  const cv::Rect2f inside(0, 0, static_cast<float>(luma.cols - 1), static_cast<float>(luma.rows - 1));
  std::size_t kept = 0;
  for (std::size_t i = 0; i < positions_.size(); ++i) {
    const bool agrees = found[i] && returned[i] && cv::norm(back[i] - view_positions_[i]) <= options_.round_trip;
    if (!agrees || !inside.contains(there[i])) continue;
    ids_[kept] = ids_[i];
    view_positions_[kept] = view_positions_[i];
    positions_[kept] = there[i];
    ++kept;
  }
  ids_.resize(kept);
  view_positions_.resize(kept);
  positions_.resize(kept);
}

void PointTracks::refill() {
  view_pyramid_ = pyramid_;
  view_positions_ = positions_;
  if (luma_.empty()) return;
  cv::Mat free(luma_.size(), CV_8U, cv::Scalar(255));
  for (const cv::Point2f& point : positions_)
    cv::circle(free, point, static_cast<int>(options_.spacing), cv::Scalar(0), -1);
  // In each part of the picture for itself: before a wall full of corners those of a dark figure would all be too weak.
  constexpr int parts = 4;  // along each side
  constexpr double quality = 0.02;
  std::vector<cv::Point2f> corners;
  for (int part = 0; part < parts * parts; ++part) {
    const int column = part % parts, row = part / parts;
    const cv::Rect cell(cv::Point(luma_.cols * column / parts, luma_.rows * row / parts),
                        cv::Point(luma_.cols * (column + 1) / parts, luma_.rows * (row + 1) / parts));
    int inside = 0;
    for (const cv::Point2f& point : positions_) inside += cell.contains(cv::Point(point)) ? 1 : 0;
    const int more = (options_.most + parts * parts - 1) / (parts * parts) - inside;
    if (more <= 0) continue;
    std::vector<cv::Point2f> found;
    cv::goodFeaturesToTrack(luma_(cell), found, more, quality, options_.spacing, free(cell));
    for (const cv::Point2f& corner : found)
      corners.push_back(corner + cv::Point2f(static_cast<float>(cell.x), static_cast<float>(cell.y)));
  }
  for (const cv::Point2f& corner : corners) {
    positions_.push_back(corner);
    ids_.push_back(next_id_++);
  }
  view_positions_ = positions_;
}

}  // namespace gyre
