// SPDX-License-Identifier: Apache-2.0
#include "device/page/latest_picture.h"

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <thread>

namespace gyre {
namespace {

using namespace std::chrono_literals;

constexpr auto long_enough = 60s;

cv::Mat grey(int level, cv::Size size = {80, 60}) {
  return {size, CV_8UC3, cv::Scalar::all(level)};
}

cv::Mat decoded(const LatestPicture::Sent& sent) {
  return cv::imdecode(std::vector<char>(sent.jpeg.begin(), sent.jpeg.end()), cv::IMREAD_COLOR);
}

double level_of(const LatestPicture::Sent& sent) {
  return cv::mean(decoded(sent))[0];
}

TEST(LatestPicture, IsTheLastOneAndNoQueue) {
  LatestPicture picture;
  EXPECT_FALSE(picture.wait(0, 0ms));
  // Anything older than half a second is not what the camera sees: tried again where the machine was that slow.
  std::optional<LatestPicture::Sent> seen;
  while (!seen) {
    for (const int level : {50, 100, 150}) picture.set(grey(level));
    seen = picture.wait(0, 0ms);
  }
  EXPECT_NEAR(level_of(*seen), 150, 2);
  EXPECT_EQ(seen->number % 3, 0u);
  EXPECT_FALSE(picture.wait(seen->number, 0ms));
}

TEST(LatestPicture, IsWaitedFor) {
  LatestPicture picture;
  EXPECT_EQ(picture.waiting(), 0);
  std::thread viewer([&] { EXPECT_NEAR(level_of(picture.wait(0, long_enough).value()), 50, 2); });
  while (picture.waiting() == 0) std::this_thread::yield();
  picture.set(grey(50));
  viewer.join();
  EXPECT_EQ(picture.waiting(), 0);
}

TEST(LatestPicture, IsNotNewWhenItIsTheSame) {
  LatestPicture picture;
  const cv::Mat image = grey(50);
  std::optional<LatestPicture::Sent> seen;
  std::thread viewer([&] { seen = picture.wait(0, long_enough); });
  while (picture.waiting() == 0) std::this_thread::yield();
  picture.set(image);
  viewer.join();
  ASSERT_TRUE(seen);
  picture.set(image);
  EXPECT_FALSE(picture.wait(seen->number, 0ms));
}

TEST(LatestPicture, IsReducedForTheWay) {
  LatestPicture picture;
  std::thread viewer([&] { EXPECT_EQ(decoded(picture.wait(0, long_enough).value()).size(), cv::Size(360, 640)); });
  while (picture.waiting() == 0) std::this_thread::yield();
  picture.set(grey(50, {720, 1280}));
  viewer.join();
}

TEST(LatestPicture, ClosesForWhoWaits) {
  LatestPicture picture;
  std::thread viewer([&] { EXPECT_FALSE(picture.wait(0, long_enough)); });
  while (picture.waiting() == 0) std::this_thread::yield();
  picture.close();
  viewer.join();
  picture.set(grey(50));
  EXPECT_FALSE(picture.wait(0, long_enough));
}

}  // namespace
}  // namespace gyre
