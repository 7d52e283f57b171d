// SPDX-License-Identifier: Apache-2.0
// A video device of Linux, as far as a camera needs it: formats, buffers in shared memory, controls. Errors say what
// the kernel said; of a device that was unplugged they say that it is gone.
#pragma once

#include "common/result/result.h"

#include <linux/videodev2.h>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace gyre {

// A way to get pictures from a device.
struct V4l2Mode {
  std::uint32_t format = 0;  // V4L2_PIX_FMT_...
  int width = 0;
  int height = 0;
  double fps = 0.0;  // the highest; 0: not said
  bool operator==(const V4l2Mode&) const = default;
};

// The one to use: of `format`, or of MJPEG, NV12, YUYV the first there is; of its sizes that come at 20 frames a
// second or more (or at the best rate) the nearest to the wanted one, or without one (0) the largest up to 1080p.
// Nothing when no mode has such a format. format: 0: any of the three.
std::optional<V4l2Mode> choose_mode(std::span<const V4l2Mode> modes, std::uint32_t format, int width, int height);

std::string format_name(std::uint32_t format);

class V4l2Device {
 public:
  // Errors: nothing there, no access, in use, no camera.
  static Result<V4l2Device> open(const std::filesystem::path& path);
  V4l2Device(V4l2Device&& other) noexcept;
  V4l2Device& operator=(V4l2Device&& other) noexcept;
  ~V4l2Device();

  // The same after the same camera was plugged into the same socket again.
  const std::string& identity() const { return identity_; }
  const std::string& card() const { return card_; }

  // MJPEG, NV12 and YUYV. Where sizes are free, usual ones.
  std::vector<V4l2Mode> modes() const;

  // What the driver made of the wish; its format is the one that was asked for.
  struct Layout {
    std::uint32_t format = 0;
    int width = 0;
    int height = 0;
    int bytes_per_line = 0;
    double fps = 0.0;
  };
  Result<Layout> set_mode(const V4l2Mode& mode);

  // Makes buffers and maps them; the number there are, which the driver may have raised. 0 gives them back.
  Result<int> make_buffers(int count);
  Result<void> queue(int buffer);
  Result<void> stream_on();
  Result<void> stream_off();

  // True when a buffer is there, or an error that dequeue() will tell.
  Result<bool> wait(std::chrono::milliseconds timeout);

  struct Filled {
    int buffer = 0;
    std::span<const std::uint8_t> bytes;  // until the buffer is queued again
    bool damaged = false;
    std::uint32_t sequence = 0;
    double stamp = 0.0;  // seconds of the driver's clock
  };
  // Nothing when none is filled.
  Result<std::optional<Filled>> dequeue();

  // Controls by V4L2_CID_...; nothing when the camera does not have it, or it cannot be used now.
  std::optional<std::int32_t> control(std::uint32_t id) const;
  bool set_control(std::uint32_t id, std::int32_t value);

 private:
  V4l2Device(int fd, std::filesystem::path path) : fd_(fd), path_(std::move(path)) {}
  void unmap();
  double best_fps(const V4l2Mode& mode) const;
  void add_sizes(std::uint32_t format, std::vector<V4l2Mode>& modes) const;
  tl::unexpected<Error> error(const std::string& what) const;

  struct Mapping {
    void* start = nullptr;
    std::size_t length = 0;
  };
  int fd_ = -1;
  std::filesystem::path path_;
  std::string identity_;
  std::string card_;
  std::vector<Mapping> mappings_;
};

}  // namespace gyre
