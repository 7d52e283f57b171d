// SPDX-License-Identifier: Apache-2.0
#include "common/video/exif.h"
#include "tests/common/video/exif_bytes.h"

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <vector>

namespace gyre {
namespace {

using test::jpeg_with_exif;
using test::png_with_exif;
using test::tiff_with_focal;
using test::tiff_with_orientation;

Orientation read(const std::string& bytes) {
  return read_exif(std::as_bytes(std::span(bytes))).orientation;
}

std::string picture(const char* extension) {
  std::vector<unsigned char> bytes;
  cv::imencode(extension, cv::Mat(8, 8, CV_8UC3, cv::Scalar(10, 20, 30)), bytes);
  return {bytes.begin(), bytes.end()};
}

TEST(Exif, ReadsEveryOrientationInBothByteOrders) {
  for (int orientation = 1; orientation <= 8; ++orientation) {
    for (const bool little_endian : {false, true}) {
      const std::string tiff = tiff_with_orientation(orientation, little_endian);
      EXPECT_EQ(static_cast<int>(read(jpeg_with_exif(picture(".jpg"), tiff))), orientation);
      EXPECT_EQ(static_cast<int>(read(png_with_exif(picture(".png"), tiff))), orientation);
    }
  }
}

TEST(Exif, ReadsTheFocalLengthInBothByteOrders) {
  for (const bool little_endian : {false, true}) {
    const std::string file = jpeg_with_exif(picture(".jpg"), tiff_with_focal(26, little_endian));
    EXPECT_EQ(read_exif(std::as_bytes(std::span(file))).focal_35mm, 26.0);
    EXPECT_EQ(read(file), Orientation::upright);
  }
  const std::string unknown = jpeg_with_exif(picture(".jpg"), tiff_with_focal(0, true));
  EXPECT_FALSE(read_exif(std::as_bytes(std::span(unknown))).focal_35mm);
  const std::string plain = picture(".jpg");
  EXPECT_FALSE(read_exif(std::as_bytes(std::span(plain))).focal_35mm);
}

TEST(Exif, AgreesWithOpenCv) {
  // A picture with a bright left half: where the bright half is tells how OpenCV turned it.
  cv::Mat image(16, 32, CV_8UC3, cv::Scalar::all(0));
  image.colRange(0, 16).setTo(cv::Scalar::all(255));
  std::vector<unsigned char> encoded;
  cv::imencode(".jpg", image, encoded);
  const std::string file = jpeg_with_exif({encoded.begin(), encoded.end()}, tiff_with_orientation(6, true));
  const cv::Mat turned = cv::imdecode(std::vector<unsigned char>(file.begin(), file.end()), cv::IMREAD_COLOR);
  ASSERT_EQ(turned.rows, 32);
  EXPECT_EQ(read(file), Orientation::rotated_90);
  EXPECT_GT(turned.at<cv::Vec3b>(4, 8)[0], 200);
}

TEST(Exif, IsUprightWithoutAnyBlock) {
  EXPECT_EQ(read(picture(".jpg")), Orientation::upright);
  EXPECT_EQ(read(picture(".png")), Orientation::upright);
  EXPECT_EQ(read(""), Orientation::upright);
  EXPECT_EQ(read("not a picture"), Orientation::upright);
}

TEST(Exif, IgnoresValuesOutsideTheStandard) {
  for (const int value : {0, 9, 255, 65535}) {
    EXPECT_EQ(read(jpeg_with_exif(picture(".jpg"), tiff_with_orientation(value, true))), Orientation::upright);
  }
}

TEST(Exif, FindsTheBlockBehindOtherSegments) {
  const std::string plain = picture(".jpg");
  const std::string with = jpeg_with_exif(plain, tiff_with_orientation(3, false));
  const std::string comment = "\xff\xfe" + test::number(7, 2, false) + "hello";
  EXPECT_EQ(read(with.substr(0, 2) + comment + with.substr(2)), Orientation::rotated_180);
  EXPECT_EQ(read(with.substr(0, 2) + "\xff" + with.substr(2)), Orientation::rotated_180) << "fill byte";
}

// Bytes from outside: nothing they say may lead outside of them (run under the address sanitizer).
TEST(Exif, SurvivesEveryTruncation) {
  for (const std::string& file : {jpeg_with_exif(picture(".jpg"), tiff_with_orientation(6, true)),
                                  png_with_exif(picture(".png"), tiff_with_orientation(6, false))}) {
    for (std::size_t size = 0; size < file.size(); ++size) {
      const std::vector<char> exact(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(size));
      const int orientation = static_cast<int>(read_exif(std::as_bytes(std::span(exact))).orientation);
      EXPECT_TRUE(orientation == 1 || orientation == 6);
    }
  }
}

TEST(Exif, SurvivesRandomDamage) {
  std::mt19937 random(7);
  const std::string sound = jpeg_with_exif(picture(".jpg"), tiff_with_orientation(6, true)).substr(0, 80);
  for (int round = 0; round < 20000; ++round) {
    std::vector<char> file(sound.begin(), sound.end());
    for (int change = 0; change < 4; ++change) {
      file[2 + random() % (file.size() - 2)] = static_cast<char>(random() % 3 == 0 ? 0xff : random() & 0xffU);
    }
    const int orientation = static_cast<int>(read_exif(std::as_bytes(std::span(file))).orientation);
    ASSERT_GE(orientation, 1);
    ASSERT_LE(orientation, 8);
  }
}

}  // namespace
}  // namespace gyre
