// SPDX-License-Identifier: Apache-2.0
#include "offload/cloud/still_background.h"

#include "common/bundle/bundle.h"

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace gyre {
namespace {

constexpr int width = 160, height = 120, count = 24;
const cv::Rect subject(60, 20, 40, 80);

cv::Mat noise(int seed) {
  cv::Mat picture(height, width, CV_8UC3);
  cv::RNG(static_cast<std::uint64_t>(seed)).fill(picture, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(picture, picture, {}, 1.2);
  return picture;
}

// A pattern that moves on by six pixels a view before a room that stays, its upper left quarter without texture.
// moving_room: the room is another one in every view.
std::vector<StereoView> views_of(const std::string& pass, bool moving_room = false) {
  const cv::Mat cloth = noise(1);
  std::vector<StereoView> views;
  for (int v = 0; v < count; ++v) {
    cv::Mat picture = noise(moving_room ? 100 + v : 2);
    picture(cv::Rect(0, 0, 40, 60)).setTo(cv::Scalar(90, 90, 90));
    cv::Mat moved;
    const double shift[] = {1, 0, -6.0 * v, 0, 1, 0};
    cv::warpAffine(cloth, moved, cv::Mat(2, 3, CV_64F, const_cast<double*>(shift)), cloth.size(), cv::INTER_LINEAR,
                   cv::BORDER_WRAP);
    moved(subject).copyTo(picture(subject));
    cv::Mat grain(height, width, CV_16SC3);
    cv::RNG(static_cast<std::uint64_t>(v + 7)).fill(grain, cv::RNG::NORMAL, 0.0, 1.5);
    cv::add(picture, grain, picture, cv::noArray(), CV_8U);
    views.push_back(make_stereo_view(frame_name(pass, v), picture,
                                     Camera{.width = width, .height = height, .fx = 150, .fy = 150, .cx = 80, .cy = 60},
                                     Pose{}, width, 1));
  }
  return views;
}

double share_within(const std::vector<char>& still, const cv::Rect& area) {
  int found = 0;
  for (int y = area.y; y < area.br().y; ++y)
    for (int x = area.x; x < area.br().x; ++x) found += still[static_cast<std::size_t>(y * width + x)];
  return static_cast<double>(found) / area.area();
}

TEST(StillBackground, is_the_room_and_neither_the_subject_nor_what_has_no_texture) {
  const auto still = still_background(views_of("turn"), {}, 2);
  ASSERT_EQ(still.size(), static_cast<std::size_t>(count));
  for (const auto& of_view : still) {
    EXPECT_GT(share_within(of_view, {110, 10, 40, 100}), 0.98);
    EXPECT_LT(share_within(of_view, {64, 24, 32, 72}), 0.01);
    EXPECT_LT(share_within(of_view, {4, 4, 32, 52}), 0.01);
  }
}

TEST(StillBackground, is_nowhere_when_the_room_moves_too) {
  for (const auto& of_view : still_background(views_of("body", true), {}, 1))
    EXPECT_LT(share_within(of_view, {44, 0, 116, 120}), 0.01);
}

TEST(StillBackground, is_sought_pass_by_pass_and_threads_change_nothing) {
  std::vector<StereoView> views = views_of("turn");
  const auto alone = still_background(views, {}, 1);
  const std::vector<StereoView> others = views_of("head", true);
  views.insert(views.end(), others.begin(), others.end());
  const auto together = still_background(views, {}, 3);
  for (std::size_t i = 0; i < alone.size(); ++i) EXPECT_EQ(alone[i], together[i]);
}

TEST(StillBackground, lies_beyond_the_subject) {
  StereoDepth map;
  map.width = 2;
  map.height = 1;
  map.state = {PixelState::surface, PixelState::surface};
  map.depth = {2.5F, 2.5F};
  put_beyond(map, {0, 1});
  EXPECT_EQ(map.state[0], PixelState::surface);
  EXPECT_EQ(map.depth[0], 2.5F);
  EXPECT_EQ(map.state[1], PixelState::beyond);
  EXPECT_GT(map.depth[1], 1000.0F);
}

}  // namespace
}  // namespace gyre
