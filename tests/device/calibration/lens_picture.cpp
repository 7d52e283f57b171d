// SPDX-License-Identifier: Apache-2.0
#include "tests/device/calibration/lens_picture.h"

#include "tests/common/board/board_picture.h"

#include <opencv2/imgproc.hpp>
#include <random>

namespace gyre {

cv::Mat picture_through_lens(const Camera& camera, const Pose& cam_from_board) {
  constexpr double margin = 0.15;  // of the picture, that the lens may bring in from outside
  Camera straight = camera.without_distortion();
  straight.width += 2 * cvRound(margin * camera.width);
  straight.height += 2 * cvRound(margin * camera.height);
  straight.cx += cvRound(margin * camera.width);
  straight.cy += cvRound(margin * camera.height);
  const cv::Mat drawn = picture_of_board(straight, cam_from_board);
  cv::Mat places(camera.height, camera.width, CV_32FC2);
  for (int y = 0; y < places.rows; ++y) {
    for (int x = 0; x < places.cols; ++x) {
      const Eigen::Vector2d at = straight.pixel_from_normalised(camera.normalised_from_pixel({x + 0.5, y + 0.5}));
      places.at<cv::Vec2f>(y, x) = {static_cast<float>(at.x() - 0.5), static_cast<float>(at.y() - 0.5)};
    }
  }
  cv::Mat picture;
  cv::remap(drawn, picture, places, cv::noArray(), cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  return picture;
}

std::vector<Pose> round_of_views(const Camera& camera, int count, double tilt) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> share(-1.0, 1.0);
  const Eigen::Vector3d middle(0.5 * board_width, 0.5 * board_height, 0);
  std::vector<Pose> views;
  for (int i = 0; i < count; ++i) {
    // Four by four places, in turn.
    const double across = -0.32 + 0.64 * (i % 4) / 3.0;
    const double down = -0.24 + 0.48 * (i / 4 % 4) / 3.0;
    const double distance = 2.6 * board_height * camera.fy / camera.height * (1.0 + 0.15 * share(random));
    const Eigen::Vector3d place(across * camera.width / camera.fx * distance,
                                down * camera.height / camera.fy * distance, distance);
    const double towards = M_PI * share(random);
    const Eigen::Vector3d axis(std::cos(towards), std::sin(towards), 0.0);
    const Eigen::Quaterniond rotation(Eigen::AngleAxisd(tilt * (0.6 + 0.4 * std::abs(share(random))), axis) *
                                      Eigen::AngleAxisd(0.3 * share(random), Eigen::Vector3d::UnitZ()));
    views.push_back({rotation, place - rotation * middle});
  }
  return views;
}

std::vector<Eigen::Vector2d> true_corners(const Camera& camera, const Pose& cam_from_board) {
  std::vector<Eigen::Vector2d> corners;
  for (int i = 0; i < board_corner_count; ++i) corners.push_back(pixel_of_corner(camera, cam_from_board, i));
  return corners;
}

}  // namespace gyre
