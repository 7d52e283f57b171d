// SPDX-License-Identifier: Apache-2.0
#include "device/camera/libcamera_buffer.h"

#include "device/camera/libcamera_streams.h"

#include <linux/dma-buf.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <algorithm>

namespace gyre {

namespace lc = libcamera;

MappedBuffer::MappedBuffer(const lc::FrameBuffer& buffer) {
  std::map<int, std::size_t> lengths;
  for (const lc::FrameBuffer::Plane& plane : buffer.planes()) {
    std::size_t& length = lengths[plane.fd.get()];
    length = std::max<std::size_t>(length, plane.offset + plane.length);
  }
  for (const auto& [fd, length] : lengths) {
    void* const start = ::mmap(nullptr, length, PROT_READ, MAP_SHARED, fd, 0);
    if (start != MAP_FAILED) areas_[fd] = {static_cast<const std::uint8_t*>(start), length};
  }
  for (const lc::FrameBuffer::Plane& plane : buffer.planes()) {
    const auto area = areas_.find(plane.fd.get());
    if (area == areas_.end()) continue;
    planes_.push_back(area->second.subspan(plane.offset, plane.length));
  }
  whole_ = planes_.size() == buffer.planes().size();
}

MappedBuffer::~MappedBuffer() {
  for (const auto& [fd, area] : areas_) ::munmap(const_cast<std::uint8_t*>(area.data()), area.size());
}

void MappedBuffer::begin_read() const {
  sync(DMA_BUF_SYNC_START);
}

void MappedBuffer::end_read() const {
  sync(DMA_BUF_SYNC_END);
}

// Memory that needs none of it says so.
void MappedBuffer::sync(std::uint64_t when) const {
  for (const auto& [fd, area] : areas_) {
    dma_buf_sync what{.flags = when | DMA_BUF_SYNC_READ};
    ::ioctl(fd, DMA_BUF_IOCTL_SYNC, &what);
  }
}

std::optional<RawPicture> copy_raw(const MappedBuffer& buffer, const lc::StreamConfiguration& stream) {
  const RawPicture::Format format = *readable(stream.pixelFormat)->raw;
  RawPicture raw{.format = format,
                 .width = static_cast<int>(stream.size.width),
                 .height = static_cast<int>(stream.size.height),
                 .bytes = {}};
  raw.bytes.reserve(raw_bytes(format, raw.width, raw.height));
  struct Part {
    std::size_t row, stride, rows;
  };
  const std::size_t width = stream.size.width;
  const std::size_t height = stream.size.height;
  const std::size_t stride = stream.stride;
  std::vector<Part> parts;
  switch (format) {
    case RawPicture::Format::i420:
      parts = {{width, stride, height}, {width / 2, stride / 2, height / 2}, {width / 2, stride / 2, height / 2}};
      break;
    case RawPicture::Format::nv12:
      parts = {{width, stride, height}, {width, stride, height / 2}};
      break;
    case RawPicture::Format::yuyv:
      parts = {{2 * width, stride, height}};
      break;
    default:
      parts = {{3 * width, stride, height}};
      break;
  }
  // Planes of their own, or one after the other in one.
  const bool apart = buffer.planes().size() == parts.size();
  std::size_t at = 0;
  buffer.begin_read();
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const Part& part = parts[i];
    const std::span<const std::uint8_t> plane = buffer.planes()[apart ? i : 0];
    if (apart) at = 0;
    const std::size_t step = std::max(part.stride, part.row);
    for (std::size_t y = 0; y < part.rows && at + part.row <= plane.size(); ++y, at += step) {
      const auto row = plane.subspan(at, part.row);
      raw.bytes.insert(raw.bytes.end(), row.begin(), row.end());
    }
  }
  buffer.end_read();
  if (raw.bytes.size() != raw_bytes(format, raw.width, raw.height)) return std::nullopt;
  return raw;
}

std::string copy_jpeg(const MappedBuffer& buffer, std::size_t used) {
  const std::span<const std::uint8_t> plane = buffer.planes().front();
  buffer.begin_read();
  std::string jpeg(plane.begin(), plane.begin() + static_cast<std::ptrdiff_t>(std::min(plane.size(), used)));
  buffer.end_read();
  return jpeg;
}

}  // namespace gyre
