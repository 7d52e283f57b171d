// SPDX-License-Identifier: Apache-2.0
#include "common/board/find_board.h"

#include "common/board/board.h"
#include "common/board/markers.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace gyre {

namespace {

constexpr int longest_side = 2000;  // larger pictures are reduced: the board stays large in them
constexpr std::size_t min_markers = 2;
constexpr double outline_error = 2.0;  // of a marker's corners, pixels
// Metres on the board.
constexpr double refined_reach = 0.009;  // around a corner; symmetric although it ends inside markers
constexpr double max_move = 0.006;       // of a corner from where the markers put it
constexpr double probe = 0.004;          // along the diagonals of a corner, where its four squares are looked at
constexpr double min_contrast = 25;      // between the black and the white ones, 8-bit levels

cv::Point2f to_cv(const Eigen::Vector2d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y())};
}

// Image from board, both in OpenCV's pixels and metres; empty when the markers do not lie on one plane.
cv::Matx33d locate(const std::vector<FoundMarker>& found, bool& located) {
  located = false;
  const std::vector<BoardMarker> markers = board_markers();
  std::vector<cv::Point2f> on_board, in_picture;
  for (const FoundMarker& f : found) {
    if (f.id >= static_cast<int>(markers.size())) continue;
    const Eigen::Vector2d corner = markers[static_cast<std::size_t>(f.id)].top_left;
    for (const Eigen::Vector2d& step : {Eigen::Vector2d(0, 0), {1, 0}, {1, 1}, {0, 1}})
      on_board.push_back(to_cv(corner + board_marker * step));
    in_picture.insert(in_picture.end(), f.corners.begin(), f.corners.end());
  }
  if (on_board.size() < 4 * min_markers) return {};
  cv::Mat inliers;
  const cv::Mat homography = cv::findHomography(on_board, in_picture, cv::RANSAC, outline_error, inliers);
  located = !homography.empty() && cv::countNonZero(inliers) >= static_cast<int>(4 * min_markers);
  return located ? cv::Matx33d(homography) : cv::Matx33d();
}

// Pixels a metre of the straightened board: twice as fine as the picture shows its longest side.
double fineness_of(const cv::Matx33d& picture_from_board) {
  const std::vector<cv::Point2f> outline{
      {0, 0}, to_cv({board_width, 0}), to_cv({board_width, board_height}), to_cv({0, board_height})};
  std::vector<cv::Point2f> seen;
  cv::perspectiveTransform(outline, seen, picture_from_board);
  double finest = 0;
  for (std::size_t i = 0; i < 4; ++i)
    finest = std::max(finest, cv::norm(seen[(i + 1) % 4] - seen[i]) / cv::norm(outline[(i + 1) % 4] - outline[i]));
  return std::clamp(2 * finest, 1000.0, 6000.0);
}

double level(const cv::Mat& grey, const cv::Point2f& at) {
  const cv::Point p(cvRound(at.x), cvRound(at.y));
  return cv::Rect({}, grey.size()).contains(p) ? grey.at<std::uint8_t>(p) : 0.0;
}

// Least difference between a white and a black square around a corner of the straightened board.
double contrast(const cv::Mat& straight, const cv::Point2f& corner, float step, bool black_first) {
  const double a = level(straight, corner + cv::Point2f(-step, -step)),
               c = level(straight, corner + cv::Point2f(step, step));
  const double b = level(straight, corner + cv::Point2f(step, -step)),
               d = level(straight, corner + cv::Point2f(-step, step));
  return black_first ? std::min(b, d) - std::max(a, c) : std::min(a, c) - std::max(b, d);
}

}  // namespace

std::vector<BoardCorner> find_board(const cv::Mat& picture) {
  cv::Mat grey;
  if (picture.channels() == 3) {
    cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
  } else {
    grey = picture;
  }
  const int side = std::max(grey.cols, grey.rows);
  const cv::Size full = grey.size();
  if (side > longest_side)
    cv::resize(grey, grey, {}, 1.0 * longest_side / side, 1.0 * longest_side / side, cv::INTER_AREA);
  bool located = false;
  const cv::Matx33d picture_from_board = locate(find_markers(grey), located);
  if (!located) return {};

  const double fineness = fineness_of(picture_from_board);
  const cv::Matx33d board_from_straight(1 / fineness, 0, 0.5 / fineness, 0, 1 / fineness, 0.5 / fineness, 0, 0, 1);
  const cv::Matx33d picture_from_straight = picture_from_board * board_from_straight;
  cv::Mat straight;
  cv::warpPerspective(grey, straight, picture_from_straight,
                      {cvRound(board_width * fineness), cvRound(board_height * fineness)},
                      cv::INTER_LINEAR | cv::WARP_INVERSE_MAP);
  std::vector<cv::Point2f> expected;
  for (int i = 0; i < board_corner_count; ++i)
    expected.push_back(to_cv(fineness * board_corner(i)) - cv::Point2f(0.5F, 0.5F));
  std::vector<cv::Point2f> refined = expected;
  const int reach = cvRound(refined_reach * fineness);
  cv::cornerSubPix(straight, refined, {reach, reach}, {-1, -1},
                   {cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 30, 0.01});
  std::vector<cv::Point2f> pixels;
  cv::perspectiveTransform(refined, pixels, picture_from_straight);

  std::vector<BoardCorner> corners;
  for (int i = 0; i < board_corner_count; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const bool black_first = (i % (board_columns - 1) + i / (board_columns - 1)) % 2 == 0;
    if (cv::norm(refined[k] - expected[k]) > max_move * fineness) continue;
    if (contrast(straight, refined[k], static_cast<float>(probe * fineness), black_first) < min_contrast) continue;
    if (!cv::Rect2f(0, 0, static_cast<float>(grey.cols - 1), static_cast<float>(grey.rows - 1)).contains(pixels[k]))
      continue;
    corners.push_back({i, Eigen::Vector2d((pixels[k].x + 0.5) * full.width / grey.cols,
                                          (pixels[k].y + 0.5) * full.height / grey.rows)});
  }
  return corners;
}

}  // namespace gyre
