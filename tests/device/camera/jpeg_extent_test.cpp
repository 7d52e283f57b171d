// SPDX-License-Identifier: Apache-2.0
#include "device/camera/jpeg_extent.h"

#include "device/camera/jpeg.h"

#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

namespace gyre {
namespace {

// Noise, so that the compressed data has many bytes of 0xff.
std::string picture(std::vector<int> parameters = {}) {
  cv::Mat noise(120, 160, CV_8UC3);
  cv::RNG random(7);
  random.fill(noise, cv::RNG::UNIFORM, 0, 256);
  std::vector<unsigned char> bytes;
  cv::imencode(".jpg", noise, bytes, parameters);
  return {bytes.begin(), bytes.end()};
}

TEST(JpegExtent, IsThePictureWhateverFollows) {
  for (const std::string& jpeg :
       {picture(), picture({cv::IMWRITE_JPEG_PROGRESSIVE, 1}), picture({cv::IMWRITE_JPEG_RST_INTERVAL, 4}),
        picture({cv::IMWRITE_JPEG_QUALITY, 100})}) {
    ASSERT_EQ(jpeg_extent(jpeg), jpeg);
    const std::string tail = jpeg.substr(jpeg.size() / 2);  // ends as a picture does
    for (const std::string& after : {std::string(100, '\0'), std::string("\xff\xff\xff"), tail, jpeg}) {
      EXPECT_EQ(jpeg_extent(jpeg + after), jpeg);
    }
    for (std::size_t size = 0; size < jpeg.size(); ++size) {
      ASSERT_TRUE(jpeg_extent(jpeg.substr(0, size)).empty()) << size;
    }
  }
}

TEST(JpegExtent, AThumbnailIsPartOfIt) {
  const std::string inner = picture({cv::IMWRITE_JPEG_QUALITY, 20});
  const std::string outer = picture();
  const std::size_t length = inner.size() + 2;
  ASSERT_LT(length, 65536U);
  std::string jpeg = outer.substr(0, 2) + "\xff\xe1";
  jpeg += static_cast<char>(length >> 8);
  jpeg += static_cast<char>(length & 0xff);
  jpeg += inner + outer.substr(2);
  EXPECT_EQ(jpeg_extent(jpeg + inner), jpeg);
  EXPECT_EQ(decode_jpeg(jpeg, 1)->size(), cv::Size(20, 15));
}

TEST(JpegExtent, OfSomethingElseIsEmpty) {
  EXPECT_TRUE(jpeg_extent("").empty());
  EXPECT_TRUE(jpeg_extent("\xff\xd9").empty());
  EXPECT_TRUE(jpeg_extent(std::string_view("\0\xff\xd8\xff\xd9", 5)).empty());
}

}  // namespace
}  // namespace gyre
