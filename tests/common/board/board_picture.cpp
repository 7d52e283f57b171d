// SPDX-License-Identifier: Apache-2.0
#include "tests/common/board/board_picture.h"

#include <opencv2/imgproc.hpp>

namespace gyre {

namespace {

constexpr double margin = 0.012;
constexpr int fine = 4;  // a side of a pixel, in samples

}  // namespace

cv::Mat draw_sheet(std::span<const BoardRectangle> black, const Eigen::Vector2d& sheet, double pixels_a_metre) {
  const auto pixels = [&](double length) { return cvRound(length * pixels_a_metre); };
  cv::Mat drawn(pixels(sheet.y()), pixels(sheet.x()), CV_8U, cv::Scalar(255));
  for (const BoardRectangle& r : black) {
    const Eigen::Vector2d end = r.top_left + r.size;
    drawn(cv::Rect(cv::Point(pixels(r.top_left.x()), pixels(r.top_left.y())),
                   cv::Point(pixels(end.x()), pixels(end.y())))) = cv::Scalar(0);
  }
  return drawn;
}

cv::Mat picture_of_board(const Camera& camera, const Pose& cam_from_board) {
  const Eigen::Vector2d sheet(board_width + 2 * margin, board_height + 2 * margin);
  std::vector<BoardRectangle> black = black_rectangles();
  for (BoardRectangle& r : black) r.top_left += Eigen::Vector2d::Constant(margin);
  // Twice as fine as the samples of the picture.
  const double finest = 2 * fine * camera.fx / (cam_from_board * Eigen::Vector3d(0.09, 0.12, 0)).z();
  const double scale = 1000 * std::clamp(std::ceil(finest / 1000), 1.0, 8.0);
  const cv::Mat drawn = draw_sheet(black, sheet, scale);
  std::vector<cv::Point2f> from, to;
  for (const Eigen::Vector2d& corner : {Eigen::Vector2d(0, 0), {1, 0}, {1, 1}, {0, 1}}) {
    const Eigen::Vector2d place = corner.cwiseProduct(sheet) - Eigen::Vector2d::Constant(margin);
    const Eigen::Vector2d pixel = fine * *camera.project(cam_from_board * Eigen::Vector3d(place.x(), place.y(), 0));
    from.emplace_back(corner.x() * drawn.cols - 0.5, corner.y() * drawn.rows - 0.5);
    to.emplace_back(pixel.x() - 0.5, pixel.y() - 0.5);
  }
  cv::Mat samples, picture;
  cv::warpPerspective(drawn, samples, cv::getPerspectiveTransform(from, to),
                      {fine * camera.width, fine * camera.height}, cv::INTER_LINEAR, cv::BORDER_CONSTANT, 110);
  cv::resize(samples, picture, {camera.width, camera.height}, 0, 0, cv::INTER_AREA);
  cv::GaussianBlur(picture, picture, {}, 0.6);
  picture.convertTo(picture, CV_8U, 0.65, 30);
  cv::Mat noise(picture.size(), CV_16S);
  cv::RNG(5).fill(noise, cv::RNG::NORMAL, 0, 3);
  cv::add(picture, noise, picture, cv::noArray(), CV_8U);
  return picture;
}

Eigen::Vector2d pixel_of_corner(const Camera& camera, const Pose& cam_from_board, int corner) {
  const Eigen::Vector2d place = board_corner(corner);
  return *camera.project(cam_from_board * Eigen::Vector3d(place.x(), place.y(), 0));
}

Pose look_at_board(double distance, double elevation, double azimuth) {
  const Eigen::Vector3d middle(0.5 * board_width, 0.5 * board_height, 0);
  // The printed side faces -z.
  const Eigen::Vector3d away(std::cos(elevation) * std::sin(azimuth), std::cos(elevation) * std::cos(azimuth),
                             -std::sin(elevation));
  const Eigen::Vector3d z = -away;
  const Eigen::Vector3d x = z.cross(-Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d rotation;
  rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  return {Eigen::Quaterniond(rotation), -(rotation * (middle + distance * away))};
}

}  // namespace gyre
