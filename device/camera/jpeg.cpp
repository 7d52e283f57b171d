// SPDX-License-Identifier: Apache-2.0
#include "device/camera/jpeg.h"

#include "device/camera/jpeg_extent.h"

#include <turbojpeg.h>
#include <algorithm>
#include <array>
#include <memory>
#include <opencv2/imgproc.hpp>

namespace gyre {

namespace {

using Format = RawPicture::Format;

struct Destroy {
  void operator()(void* handle) const { tjDestroy(handle); }
};
using Handle = std::unique_ptr<void, Destroy>;

const unsigned char* bytes_of(std::string_view text) {
  return reinterpret_cast<const unsigned char*>(text.data());
}

bool has_three_bytes(Format format) {
  return format == Format::bgr || format == Format::rgb;
}

struct Planes {
  std::vector<std::uint8_t> chroma;  // what had to be taken apart
  std::vector<std::uint8_t> luma;
  std::array<const unsigned char*, 3> data{};
  std::array<int, 3> strides{};
  int subsampling = TJSAMP_420;
};

Planes planes_of(const RawPicture& picture) {
  const auto width = static_cast<std::size_t>(picture.width);
  const auto height = static_cast<std::size_t>(picture.height);
  const std::uint8_t* const from = picture.bytes.data();
  Planes planes;
  const int half = picture.width / 2;
  planes.strides = {picture.width, half, half};
  if (picture.format == Format::yuyv) {
    const std::size_t pairs = width / 2 * height;
    planes.subsampling = TJSAMP_422;
    planes.luma.resize(2 * pairs);
    planes.chroma.resize(2 * pairs);
    for (std::size_t i = 0; i < pairs; ++i) {
      planes.luma[2 * i] = from[4 * i];
      planes.luma[2 * i + 1] = from[4 * i + 2];
      planes.chroma[i] = from[4 * i + 1];
      planes.chroma[pairs + i] = from[4 * i + 3];
    }
    planes.data = {planes.luma.data(), planes.chroma.data(), planes.chroma.data() + pairs};
    return planes;
  }
  const std::size_t pairs = width / 2 * (height / 2);
  const std::uint8_t* const chroma = from + width * height;
  planes.data = {from, chroma, chroma + pairs};
  if (picture.format == Format::nv12) {
    planes.chroma.resize(2 * pairs);
    for (std::size_t i = 0; i < pairs; ++i) {
      planes.chroma[i] = chroma[2 * i];
      planes.chroma[pairs + i] = chroma[2 * i + 1];
    }
    planes.data = {from, planes.chroma.data(), planes.chroma.data() + pairs};
  }
  return planes;
}

tl::unexpected<Error> ends_too_early(std::string_view jpeg) {
  return fail("the picture ends too early", std::to_string(jpeg.size()) + " bytes");
}

// jpeg: its extent.
Result<cv::Mat> decode_whole(std::string_view jpeg, int least_side) {
  const Handle handle(tjInitDecompress());
  int width = 0;
  int height = 0;
  int subsampling = 0;
  int colours = 0;
  if (!handle ||
      tjDecompressHeader3(handle.get(), bytes_of(jpeg), jpeg.size(), &width, &height, &subsampling, &colours) != 0)
    return fail("the picture is no JPEG", std::to_string(jpeg.size()) + " bytes");
  tjscalingfactor scale{1, 1};
  for (const int denominator : {2, 4, 8}) {
    const tjscalingfactor smaller{1, denominator};
    if (TJSCALED(std::max(width, height), smaller) >= least_side) scale = smaller;
  }
  const int columns = TJSCALED(width, scale);
  const int rows = TJSCALED(height, scale);
  cv::Mat image;
  try {
    image.create(rows, columns, CV_8UC3);
  } catch (const cv::Exception&) {
    return fail("the picture claims an impossible size", std::to_string(width) + "x" + std::to_string(height));
  }
  const int decoded = tjDecompress2(handle.get(), bytes_of(jpeg), jpeg.size(), image.data, columns,
                                    static_cast<int>(image.step), rows, TJPF_BGR, 0);
  const std::string_view message = decoded == 0 ? "" : tjGetErrorStr2(handle.get());
  if (decoded != 0 && message.find("extraneous") == std::string_view::npos)
    return fail("the picture is damaged", std::string(message));
  return image;
}

}  // namespace

Result<cv::Mat> decode_jpeg(std::string_view jpeg, int least_side) {
  const std::string_view picture = jpeg_extent(jpeg);
  return picture.empty() ? ends_too_early(jpeg) : decode_whole(picture, least_side);
}

Result<cv::Mat> cut_and_decode_jpeg(std::string& jpeg, int least_side) {
  const std::size_t size = jpeg_extent(jpeg).size();
  if (size == 0) return ends_too_early(jpeg);
  jpeg.resize(size);
  return decode_whole(jpeg, least_side);
}

Result<cv::Size> jpeg_size(std::string_view jpeg) {
  const Handle handle(tjInitDecompress());
  cv::Size size;
  int subsampling = 0;
  int colours = 0;
  if (!handle || tjDecompressHeader3(handle.get(), bytes_of(jpeg), jpeg.size(), &size.width, &size.height, &subsampling,
                                     &colours) != 0)
    return fail("the picture is no JPEG", std::to_string(jpeg.size()) + " bytes");
  return size;
}

std::size_t raw_bytes(Format format, int width, int height) {
  const auto columns = static_cast<std::size_t>(width);
  const auto rows = static_cast<std::size_t>(height);
  switch (format) {
    case Format::yuyv:
      return columns / 2 * 4 * rows;
    case Format::bgr:
    case Format::rgb:
      return 3 * columns * rows;
    default:
      return columns * rows + columns / 2 * (rows / 2) * 2;
  }
}

cv::Mat reduced_bgr(const RawPicture& picture, int longer_side) {
  auto* const bytes = const_cast<std::uint8_t*>(picture.bytes.data());  // OpenCV has no matrix that is only read
  cv::Mat bgr;
  switch (picture.format) {
    case Format::yuyv:
      cv::cvtColor(cv::Mat(picture.height, picture.width, CV_8UC2, bytes), bgr, cv::COLOR_YUV2BGR_YUY2);
      break;
    case Format::nv12:
      cv::cvtColor(cv::Mat(picture.height * 3 / 2, picture.width, CV_8UC1, bytes), bgr, cv::COLOR_YUV2BGR_NV12);
      break;
    case Format::i420:
      cv::cvtColor(cv::Mat(picture.height * 3 / 2, picture.width, CV_8UC1, bytes), bgr, cv::COLOR_YUV2BGR_I420);
      break;
    case Format::bgr:
      bgr = cv::Mat(picture.height, picture.width, CV_8UC3, bytes);
      break;
    case Format::rgb:
      cv::cvtColor(cv::Mat(picture.height, picture.width, CV_8UC3, bytes), bgr, cv::COLOR_RGB2BGR);
      break;
  }
  const double scale = static_cast<double>(longer_side) / std::max(picture.width, picture.height);
  if (scale >= 1.0) return picture.format == Format::bgr ? bgr.clone() : bgr;
  cv::Mat reduced;
  cv::resize(bgr, reduced, {}, scale, scale, cv::INTER_AREA);
  return reduced;
}

Result<std::string> encode_jpeg(const RawPicture& picture, int quality) {
  const bool odd = !has_three_bytes(picture.format) && (picture.width % 2 != 0 || picture.height % 2 != 0);
  if (picture.width <= 0 || picture.height <= 0 || odd ||
      picture.bytes.size() != raw_bytes(picture.format, picture.width, picture.height))
    return fail("a raw picture of a wrong size", std::to_string(picture.bytes.size()) + " bytes for " +
                                                     std::to_string(picture.width) + "x" +
                                                     std::to_string(picture.height));
  const Handle handle(tjInitCompress());
  unsigned char* out = nullptr;
  unsigned long size = 0;
  int done = -1;
  if (handle && has_three_bytes(picture.format)) {
    done = tjCompress2(handle.get(), picture.bytes.data(), picture.width, 3 * picture.width, picture.height,
                       picture.format == Format::bgr ? TJPF_BGR : TJPF_RGB, &out, &size, TJSAMP_420, quality, 0);
  } else if (handle) {
    Planes planes = planes_of(picture);
    done = tjCompressFromYUVPlanes(handle.get(), planes.data.data(), picture.width, planes.strides.data(),
                                   picture.height, planes.subsampling, &out, &size, quality, 0);
  }
  const std::unique_ptr<unsigned char, decltype(&tjFree)> owned(out, &tjFree);
  if (done != 0) return fail("cannot compress a picture as JPEG", handle ? tjGetErrorStr2(handle.get()) : "");
  return std::string(reinterpret_cast<const char*>(out), size);
}

}  // namespace gyre
