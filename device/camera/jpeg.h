// SPDX-License-Identifier: Apache-2.0
// JPEG as cameras need it: decoded small, checked for damage, compressed from what sensors give (libjpeg-turbo).
#pragma once

#include "common/result/result.h"

#include <cstddef>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace gyre {

// Longer side that is enough for everything that is measured on a frame, pixels; see MeasureOptions.
inline constexpr int analysis_side = 640;

// 8-bit BGR, reduced by the decoder (DCT scaling, to 1/2, 1/4 or 1/8) as far as the longer side stays at least
// `least_side`. Errors: bytes that are no JPEG, or one that is damaged or ends too early.
Result<cv::Mat> decode_jpeg(std::string_view jpeg, int least_side);

// The same of what a camera gave; what follows the picture in it, see jpeg_extent.h, is cut off.
Result<cv::Mat> cut_and_decode_jpeg(std::string& jpeg, int least_side);

// Width and height that the header says. Error: no header.
Result<cv::Size> jpeg_size(std::string_view jpeg);

// A picture as it came, rows without padding.
struct RawPicture {
  enum class Format {
    yuyv,  // Y0 U Y1 V, two pixels in four bytes
    nv12,  // Y, then U and V in turn at half the width and height
    i420,  // Y, U, V, the latter two at half the width and height
    bgr,   // B, G, R
    rgb,   // R, G, B
  };
  Format format = Format::yuyv;
  int width = 0;  // even but for bgr and rgb
  int height = 0;
  std::vector<std::uint8_t> bytes;
};

// Bytes of a picture of that format and size.
std::size_t raw_bytes(RawPicture::Format format, int width, int height);

// 8-bit BGR, reduced by area averaging until the longer side is `longer_side` (not when it is shorter).
cv::Mat reduced_bgr(const RawPicture& picture, int longer_side);

// Quality 1 to 100. Errors: bytes that do not fit the size.
Result<std::string> encode_jpeg(const RawPicture& picture, int quality);

}  // namespace gyre
