// SPDX-License-Identifier: Apache-2.0
#include "device/camera/encode_pool.h"

#include <gtest/gtest.h>
#include <vector>

namespace gyre {
namespace {

constexpr int side = 64;
constexpr std::size_t picture_bytes = 3 * side * side;

RawPicture grey(int level) {
  return {.format = RawPicture::Format::bgr,
          .width = side,
          .height = side,
          .bytes = std::vector<std::uint8_t>(picture_bytes, static_cast<std::uint8_t>(level))};
}

int level_of(const Result<std::string>& jpeg) {
  return jpeg ? decode_jpeg(*jpeg, side)->at<cv::Vec3b>(side / 2, side / 2)[0] : -1;
}

TEST(EncodePool, CompressesOnlyWhatIsAskedFor) {
  EncodePool pool;
  std::vector<std::shared_ptr<const FullPicture>> pictures;
  for (int i = 0; i < 10; ++i) pictures.push_back(pool.keep(grey(20 * i)));
  EXPECT_EQ(pool.bytes(), 10 * picture_bytes);
  EXPECT_NEAR(level_of(pictures[3]->jpeg()), 60, 1);
  EXPECT_NEAR(level_of(pictures[7]->jpeg()), 140, 1);
  EXPECT_NEAR(level_of(pictures[3]->jpeg()), 60, 1);
  EXPECT_EQ(pool.compressed(), 2);
  EXPECT_EQ(pool.bytes(), 8 * picture_bytes);
  pictures.clear();
  EXPECT_EQ(pool.bytes(), 0U);
}

TEST(EncodePool, NeverHoldsMoreThanAgreed) {
  EncodePool pool({.threads = 1, .quality = 90, .most_bytes = 8 * picture_bytes});
  std::vector<std::shared_ptr<const FullPicture>> pictures;
  for (int i = 0; i < 200; ++i) {
    const std::shared_ptr<const FullPicture> picture = pool.keep(grey(i));
    EXPECT_LE(pool.bytes(), 8 * picture_bytes);
    if (picture) pictures.push_back(picture);
  }
  // What is old was compressed unasked, so that there is room again.
  EXPECT_GE(pictures.size(), 8U);
  for (const auto& picture : pictures) EXPECT_TRUE(picture->jpeg());
  EXPECT_TRUE(pool.keep(grey(1)));
}

TEST(EncodePool, RefusesWhatHasNoRoom) {
  EncodePool pool({.threads = 1, .quality = 90, .most_bytes = picture_bytes - 1});
  EXPECT_FALSE(pool.keep(grey(1)));
  EXPECT_EQ(pool.bytes(), 0U);
}

TEST(EncodePool, PicturesOutliveIt) {
  std::shared_ptr<const FullPicture> asked;
  std::shared_ptr<const FullPicture> unasked;
  {
    EncodePool pool;
    asked = pool.keep(grey(100));
    unasked = pool.keep(grey(50));
  }
  EXPECT_NEAR(level_of(asked->jpeg()), 100, 1);
}

TEST(EncodePool, AnImpossiblePictureIsAnErrorWhenAskedFor) {
  EncodePool pool;
  RawPicture picture = grey(1);
  picture.width = 1;
  EXPECT_FALSE(pool.keep(std::move(picture))->jpeg());
}

}  // namespace
}  // namespace gyre
