// SPDX-License-Identifier: Apache-2.0
#include "device/camera/libcamera_streams.h"

#include <libcamera/formats.h>
#include <spdlog/spdlog.h>
#include <algorithm>
#include <array>
#include <cmath>

namespace gyre {

namespace {

namespace lc = libcamera;

// The best first.
const std::array<ReadableFormat, 6>& readable_formats() {
  static const std::array<ReadableFormat, 6> formats = {{{lc::formats::MJPEG, std::nullopt},
                                                         {lc::formats::YUV420, RawPicture::Format::i420},
                                                         {lc::formats::NV12, RawPicture::Format::nv12},
                                                         {lc::formats::YUYV, RawPicture::Format::yuyv},
                                                         {lc::formats::BGR888, RawPicture::Format::rgb},
                                                         {lc::formats::RGB888, RawPicture::Format::bgr}}};
  return formats;
}

// Gives a stream the first of these formats that it has, and a size near the wanted one.
bool choose_format(lc::StreamConfiguration& stream, const lc::Size& wanted, bool raw) {
  const std::vector<lc::PixelFormat> offered = stream.formats().pixelformats();
  for (const ReadableFormat& known : readable_formats()) {
    if (raw && !known.raw) continue;
    if (!offered.empty() && std::find(offered.begin(), offered.end(), known.format) == offered.end()) continue;
    stream.pixelFormat = known.format;
    stream.size = wanted;
    const auto distance = [&](const lc::Size& size) {
      return std::abs(static_cast<double>(size.width) - wanted.width) +
             std::abs(static_cast<double>(size.height) - wanted.height);
    };
    const lc::SizeRange range = stream.formats().range(known.format);
    const std::vector<lc::Size> sizes = stream.formats().sizes(known.format);
    // A range without steps only says between what the sizes lie that there are.
    const bool is_free = range.hStep != 0 && range.vStep != 0 && range.contains(wanted);
    if (!sizes.empty() && !is_free) {
      stream.size = *std::min_element(sizes.begin(), sizes.end(),
                                      [&](const lc::Size& a, const lc::Size& b) { return distance(a) < distance(b); });
    }
    return true;
  }
  return false;
}

lc::Size reduced(const lc::Size& size) {
  const unsigned longer = std::max(size.width, size.height);
  const auto even = [&](unsigned side) { return side * analysis_side / longer / 2 * 2; };
  return {even(size.width), even(size.height)};
}

}  // namespace

const ReadableFormat* readable(const lc::PixelFormat& format) {
  const auto& formats = readable_formats();
  const auto* const found =
      std::find_if(formats.begin(), formats.end(), [&](const ReadableFormat& known) { return known.format == format; });
  return found == formats.end() ? nullptr : found;
}

std::string text_of(const lc::CameraConfiguration& configuration) {
  std::string text;
  for (const lc::StreamConfiguration& stream : configuration) {
    if (!text.empty()) text += " and ";
    text += stream.toString() + ", " + std::to_string(stream.bufferCount) + " buffers";
  }
  return text;
}

Result<std::unique_ptr<lc::CameraConfiguration>> choose_streams(const StreamOffer& offer, const CameraName& name,
                                                                const std::string& camera) {
  lc::Size wanted(static_cast<unsigned>(name.width), static_cast<unsigned>(name.height));
  for (const bool two : {true, false}) {
    std::vector<lc::StreamRole> roles = {lc::StreamRole::VideoRecording};
    if (two) roles.push_back(lc::StreamRole::Viewfinder);
    std::unique_ptr<lc::CameraConfiguration> chosen = offer(roles);
    if (!chosen || chosen->size() != roles.size()) continue;
    lc::StreamConfiguration& main = chosen->at(0);
    if (wanted.isNull()) wanted = main.size;
    if (!choose_format(main, wanted, two)) continue;
    main.bufferCount = static_cast<unsigned>(name.buffers);
    if (two) {
      lc::StreamConfiguration& small = chosen->at(1);
      if (!choose_format(small, reduced(wanted), true)) continue;
      small.bufferCount = main.bufferCount;
    }
    const std::string asked = text_of(*chosen);
    const lc::CameraConfiguration::Status status = chosen->validate();
    if (status == lc::CameraConfiguration::Invalid || chosen->size() != roles.size()) continue;
    if (!std::all_of(chosen->begin(), chosen->end(), [](const auto& stream) { return readable(stream.pixelFormat); }))
      continue;
    spdlog::info("{}: {}", camera, text_of(*chosen));
    if (status == lc::CameraConfiguration::Adjusted) spdlog::warn("{}: {} was asked for", camera, asked);
    return chosen;
  }
  return fail("the camera has no picture format that can be read", camera);
}

}  // namespace gyre
