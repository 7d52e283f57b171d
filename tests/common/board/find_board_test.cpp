// SPDX-License-Identifier: Apache-2.0
#include "common/board/find_board.h"

#include "tests/common/board/board_picture.h"

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace gyre {
namespace {

constexpr double degree = 0.017453292519943295;

const Camera phone{.width = 720, .height = 1280, .fx = 1150, .fy = 1150, .cx = 358.7, .cy = 643.2};

void expect_all_corners(const std::vector<BoardCorner>& found, const Camera& camera, const Pose& cam_from_board,
                        double mean_error, double largest_error) {
  ASSERT_EQ(found.size(), static_cast<std::size_t>(board_corner_count));
  double sum = 0;
  for (int i = 0; i < board_corner_count; ++i) {
    const BoardCorner& corner = found[static_cast<std::size_t>(i)];
    EXPECT_EQ(corner.corner, i);
    const double error = (corner.pixel - pixel_of_corner(camera, cam_from_board, i)).norm();
    EXPECT_LT(error, largest_error) << "corner " << i;
    sum += error;
  }
  EXPECT_LT(sum / board_corner_count, mean_error);
}

TEST(FindBoard, names_and_places_every_corner_as_a_camera_walks_around_it) {
  for (double azimuth = 10; azimuth < 360; azimuth += 50) {
    SCOPED_TRACE(azimuth);
    const Pose pose = look_at_board(1.6, 45 * degree, azimuth * degree);
    expect_all_corners(find_board(picture_of_board(phone, pose)), phone, pose, 0.15, 0.3);
  }
}

TEST(FindBoard, bears_a_flat_view_from_two_metres) {
  const Pose pose = look_at_board(2.0, 32 * degree, 25 * degree);
  expect_all_corners(find_board(picture_of_board(phone, pose)), phone, pose, 0.3, 0.7);
}

TEST(FindBoard, is_the_same_in_a_large_colour_picture) {
  const Camera camera{.width = 2400, .height = 3200, .fx = 2900, .fy = 2900, .cx = 1200, .cy = 1600};
  const Pose pose = look_at_board(1.2, 50 * degree, 200 * degree);
  cv::Mat picture;
  cv::cvtColor(picture_of_board(camera, pose), picture, cv::COLOR_GRAY2BGR);
  expect_all_corners(find_board(picture), camera, pose, 0.3, 0.6);
}

TEST(FindBoard, leaves_out_what_a_foot_covers) {
  const Pose pose = look_at_board(1.6, 45 * degree, 0);
  cv::Mat picture = picture_of_board(phone, pose);
  const Eigen::Vector2d covered = pixel_of_corner(phone, pose, 5);
  cv::circle(picture, cv::Point(cvRound(covered.x()), cvRound(covered.y())), 16, 60, cv::FILLED);
  const auto found = find_board(picture);
  ASSERT_GE(found.size(), 3u);
  for (const BoardCorner& corner : found) {
    EXPECT_NE(corner.corner, 5);
    EXPECT_LT((corner.pixel - pixel_of_corner(phone, pose, corner.corner)).norm(), 0.4);
  }
}

TEST(FindBoard, is_nowhere_in_a_picture_without_it) {
  EXPECT_TRUE(find_board(cv::Mat(480, 640, CV_8UC3, cv::Scalar(90, 120, 150))).empty());
  cv::Mat noise(960, 640, CV_8U);
  for (int seed = 0; seed < 5; ++seed) {
    cv::RNG(static_cast<std::uint64_t>(seed + 1)).fill(noise, cv::RNG::UNIFORM, 0, 256);
    cv::GaussianBlur(noise, noise, {}, 1.0 + seed);
    cv::normalize(noise, noise, 0, 255, cv::NORM_MINMAX);
    EXPECT_TRUE(find_board(noise).empty());
  }
  // Nor is a mirrored one the board.
  cv::Mat mirrored;
  cv::flip(picture_of_board(phone, look_at_board(1.6, 45 * degree, 0)), mirrored, 1);
  EXPECT_TRUE(find_board(mirrored).empty());
  EXPECT_TRUE(find_board(cv::Mat(1, 1, CV_8U, cv::Scalar(0))).empty());
}

}  // namespace
}  // namespace gyre
