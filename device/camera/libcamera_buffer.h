// SPDX-License-Identifier: Apache-2.0
// Reading what libcamera has put into memory.
#pragma once

#include "device/camera/jpeg.h"

#include <libcamera/framebuffer.h>
#include <libcamera/stream.h>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace gyre {

// Memory of a frame buffer, mapped as long as this lives.
class MappedBuffer {
 public:
  explicit MappedBuffer(const libcamera::FrameBuffer& buffer);
  MappedBuffer(const MappedBuffer&) = delete;
  MappedBuffer& operator=(const MappedBuffer&) = delete;
  ~MappedBuffer();

  // False: not all of it can be read.
  bool whole() const { return whole_; }
  const std::vector<std::span<const std::uint8_t>>& planes() const { return planes_; }

  // Around reading, so that the processor sees what the camera wrote.
  void begin_read() const;
  void end_read() const;

 private:
  void sync(std::uint64_t when) const;

  std::map<int, std::span<const std::uint8_t>> areas_;  // by file descriptor
  std::vector<std::span<const std::uint8_t>> planes_;
  bool whole_ = false;
};

// The picture in a buffer of a stream whose format is raw, without what pads its rows; nothing when the buffer is too
// short for one.
std::optional<RawPicture> copy_raw(const MappedBuffer& buffer, const libcamera::StreamConfiguration& stream);

// The first bytes of a buffer, at most `used`.
std::string copy_jpeg(const MappedBuffer& buffer, std::size_t used);

}  // namespace gyre
