// SPDX-License-Identifier: Apache-2.0
// Which streams a camera of libcamera is asked for, and how the pictures in them are read.
#pragma once

#include "common/result/result.h"
#include "device/camera/camera_name.h"
#include "device/camera/jpeg.h"

#include <libcamera/camera.h>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace gyre {

// How a stream's pictures are read. libcamera names pixels as the kernel does, by words: BGR888 is R, G, B in bytes.
struct ReadableFormat {
  libcamera::PixelFormat format;
  std::optional<RawPicture::Format> raw;  // nothing: JPEG
};

// Null: not at all.
const ReadableFormat* readable(const libcamera::PixelFormat& format);

// What a camera offers for such roles; null or with fewer streams when it has not that many.
using StreamOffer = std::function<std::unique_ptr<libcamera::CameraConfiguration>(std::vector<libcamera::StreamRole>)>;

// A configuration that libcamera has validated: a main stream as the name says, or as the camera likes it, and a small
// one for analysis where the camera has two at once. camera: its id; under it goes into the log what was chosen, and
// what was asked for when libcamera has adjusted that. Error: no picture format that can be read.
Result<std::unique_ptr<libcamera::CameraConfiguration>> choose_streams(const StreamOffer& offer, const CameraName& name,
                                                                       const std::string& camera);

// One line of the streams, with their sizes, formats and buffers.
std::string text_of(const libcamera::CameraConfiguration& configuration);

}  // namespace gyre
