// SPDX-License-Identifier: Apache-2.0
#include "device/camera/jpeg.h"

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace gyre {
namespace {

using Format = RawPicture::Format;

// Smooth colours that survive subsampling.
cv::Mat scene(int width, int height) {
  cv::Mat bgr(height, width, CV_8UC3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x)
      bgr.at<cv::Vec3b>(y, x) =
          cv::Vec3b(static_cast<uchar>(40 + 150 * x / width), static_cast<uchar>(60 + 100 * y / height),
                    static_cast<uchar>(200 - 120 * x / width));
  }
  return bgr;
}

RawPicture raw(const cv::Mat& bgr, Format format) {
  RawPicture picture{.format = format, .width = bgr.cols, .height = bgr.rows, .bytes = {}};
  cv::Mat yuv;
  if (format == Format::bgr) {
    picture.bytes.assign(bgr.datastart, bgr.dataend);
    return picture;
  }
  if (format == Format::rgb) {
    cv::cvtColor(bgr, yuv, cv::COLOR_BGR2RGB);
    picture.bytes.assign(yuv.datastart, yuv.dataend);
    return picture;
  }
  cv::cvtColor(bgr, yuv, cv::COLOR_BGR2YUV_I420);
  picture.bytes.assign(yuv.datastart, yuv.dataend);
  if (format == Format::i420) return picture;
  const auto pixels = bgr.total();
  const auto quarter = pixels / 4;
  const std::vector<std::uint8_t> planar = picture.bytes;
  if (format == Format::nv12) {
    for (std::size_t i = 0; i < quarter; ++i) {
      picture.bytes[pixels + 2 * i] = planar[pixels + i];
      picture.bytes[pixels + 2 * i + 1] = planar[pixels + quarter + i];
    }
    return picture;
  }
  picture.bytes.clear();
  const auto width = static_cast<std::size_t>(bgr.cols);
  for (std::size_t i = 0; i < pixels; i += 2) {
    const std::size_t chroma = i / width / 2 * (width / 2) + i % width / 2;
    for (const std::uint8_t byte :
         {planar[i], planar[pixels + chroma], planar[i + 1], planar[pixels + quarter + chroma]})
      picture.bytes.push_back(byte);
  }
  return picture;
}

double difference(const cv::Mat& a, const cv::Mat& b) {
  return cv::norm(a, b, cv::NORM_L1) / static_cast<double>(a.total()) / 3.0;
}

TEST(Jpeg, EveryRawFormatShowsTheSamePicture) {
  const cv::Mat truth = scene(64, 48);
  for (const Format format : {Format::yuyv, Format::nv12, Format::i420, Format::bgr, Format::rgb}) {
    const RawPicture picture = raw(truth, format);
    ASSERT_EQ(picture.bytes.size(), raw_bytes(format, 64, 48));
    const Result<std::string> jpeg = encode_jpeg(picture, 95);
    ASSERT_TRUE(jpeg) << jpeg.error().message();
    const Result<cv::Mat> decoded = decode_jpeg(*jpeg, 640);
    ASSERT_TRUE(decoded);
    EXPECT_LT(difference(*decoded, truth), 8.0) << static_cast<int>(format);  // BT.601 studio against full range
    EXPECT_LT(difference(reduced_bgr(picture, 640), truth), 2.5) << static_cast<int>(format);
    EXPECT_EQ(reduced_bgr(picture, 32).size(), cv::Size(32, 24));
  }
}

TEST(Jpeg, IsDecodedAsSmallAsIsAllowed) {
  const std::string jpeg = encode_jpeg(raw(scene(1280, 720), Format::bgr), 90).value();
  EXPECT_EQ(jpeg_size(jpeg).value(), cv::Size(1280, 720));
  EXPECT_EQ(decode_jpeg(jpeg, 1281)->size(), cv::Size(1280, 720));
  EXPECT_EQ(decode_jpeg(jpeg, 640)->size(), cv::Size(640, 360));
  EXPECT_EQ(decode_jpeg(jpeg, 1)->size(), cv::Size(160, 90));
}

TEST(Jpeg, ATornOneIsAnErrorAndPaddingIsNot) {
  const std::string jpeg = encode_jpeg(raw(scene(320, 240), Format::bgr), 90).value();
  EXPECT_TRUE(decode_jpeg(jpeg + std::string(100, '\0'), 1));
  for (std::size_t size = 0; size < jpeg.size(); size += 97) EXPECT_FALSE(decode_jpeg(jpeg.substr(0, size), 1));
  std::string hollow = jpeg;
  hollow.erase(hollow.size() / 2, hollow.size() / 4);
  EXPECT_FALSE(decode_jpeg(hollow, 1));
  EXPECT_FALSE(jpeg_size("no picture"));
}

TEST(Jpeg, RefusesRawPicturesOfWrongSize) {
  RawPicture picture = raw(scene(64, 48), Format::nv12);
  picture.bytes.pop_back();
  EXPECT_FALSE(encode_jpeg(picture, 95));
  EXPECT_FALSE(
      encode_jpeg({.format = Format::yuyv, .width = 63, .height = 2, .bytes = std::vector<std::uint8_t>(248)}, 95));
  EXPECT_FALSE(encode_jpeg({}, 95));
}

}  // namespace
}  // namespace gyre
