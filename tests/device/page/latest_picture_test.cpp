// SPDX-License-Identifier: Apache-2.0
#include "device/page/latest_picture.h"

#include <gtest/gtest.h>
#include <thread>

namespace gyre {
namespace {

using namespace std::chrono_literals;

constexpr auto long_enough = 60s;

TEST(LatestPicture, IsTheLastOneAndNoQueue) {
  LatestPicture picture;
  EXPECT_FALSE(picture.wait(0, 0ms));
  picture.set("one");
  picture.set("two");
  picture.set("three");
  const auto seen = picture.wait(0, 0ms);
  ASSERT_TRUE(seen);
  EXPECT_EQ(*seen->jpeg, "three");
  EXPECT_EQ(seen->number, 3u);
  EXPECT_FALSE(picture.wait(seen->number, 0ms));
  // A number from before a restart.
  EXPECT_EQ(picture.wait(900, 0ms)->number, 3u);
}

TEST(LatestPicture, IsWantedWhileSomebodyWaits) {
  LatestPicture picture;
  EXPECT_FALSE(picture.is_wanted());
  std::thread viewer([&] { EXPECT_EQ(*picture.wait(0, long_enough)->jpeg, "one"); });
  while (!picture.is_wanted()) std::this_thread::yield();
  picture.set("one");
  viewer.join();
  EXPECT_FALSE(picture.is_wanted());
}

TEST(LatestPicture, ClosesForWhoWaits) {
  LatestPicture picture;
  std::thread viewer([&] { EXPECT_FALSE(picture.wait(0, long_enough)); });
  while (!picture.is_wanted()) std::this_thread::yield();
  picture.close();
  viewer.join();
  picture.set("one");
  EXPECT_FALSE(picture.wait(0, long_enough));
}

}  // namespace
}  // namespace gyre
