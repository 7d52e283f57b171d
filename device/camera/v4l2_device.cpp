// SPDX-License-Identifier: Apache-2.0
#include "device/camera/v4l2_device.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

namespace gyre {

namespace {

constexpr std::array<std::uint32_t, 3> known_formats = {V4L2_PIX_FMT_MJPEG, V4L2_PIX_FMT_NV12, V4L2_PIX_FMT_YUYV};
constexpr double fast_enough = 20.0;  // frames a second

int call(int fd, unsigned long request, void* argument) {
  int result = 0;
  do result = ::ioctl(fd, request, argument);
  while (result < 0 && errno == EINTR);
  return result;
}

double fps_of(const v4l2_fract& interval) {
  return interval.numerator == 0 ? 0.0 : static_cast<double>(interval.denominator) / interval.numerator;
}

v4l2_buffer buffer_of(int index) {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = static_cast<std::uint32_t>(index);
  return buffer;
}

bool is_within(const v4l2_frmsize_stepwise& sizes, int width, int height) {
  const auto fits = [](std::uint32_t value, std::uint32_t least, std::uint32_t most, std::uint32_t step) {
    return value >= least && value <= most && (step <= 1 || (value - least) % step == 0);
  };
  return fits(static_cast<std::uint32_t>(width), sizes.min_width, sizes.max_width, sizes.step_width) &&
         fits(static_cast<std::uint32_t>(height), sizes.min_height, sizes.max_height, sizes.step_height);
}

}  // namespace

std::string format_name(std::uint32_t format) {
  constexpr std::uint32_t byte = 0xff;
  std::string name;
  for (int shift = 0; shift < 32; shift += 8) name += static_cast<char>(format >> shift & byte);
  return name;
}

std::optional<V4l2Mode> choose_mode(std::span<const V4l2Mode> modes, std::uint32_t format, int width, int height) {
  std::vector<V4l2Mode> fitting;
  for (const std::uint32_t known : known_formats) {
    if (!fitting.empty() || (format != 0 && format != known)) continue;
    std::copy_if(modes.begin(), modes.end(), std::back_inserter(fitting),
                 [&](const V4l2Mode& mode) { return mode.format == known; });
  }
  if (fitting.empty()) return std::nullopt;
  constexpr int largest = 1920;  // of the longer side
  const auto area = [](const V4l2Mode& mode) { return static_cast<double>(mode.width) * mode.height; };
  const auto cost = [&](const V4l2Mode& mode) {
    if (width > 0) return static_cast<double>(std::abs(mode.width - width) + std::abs(mode.height - height));
    return std::max(mode.width, mode.height) <= largest ? -area(mode) : area(mode);
  };
  const double best_fps =
      std::max_element(fitting.begin(), fitting.end(), [](const auto& a, const auto& b) { return a.fps < b.fps; })->fps;
  const double least_fps = width > 0 ? 0.0 : std::min(best_fps, fast_enough);
  const V4l2Mode* best = nullptr;
  for (const V4l2Mode& mode : fitting) {
    if (mode.fps >= least_fps && (best == nullptr || cost(mode) < cost(*best))) best = &mode;
  }
  return *best;
}

Result<V4l2Device> V4l2Device::open(const std::filesystem::path& path) {
  const int fd = ::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  V4l2Device device(fd, path);
  if (fd < 0) {
    if (errno == EACCES) return fail("no access to the camera", path.string(), "join the group video");
    return fail("no camera there", path.string() + " (" + std::strerror(errno) + ")", "check that it is plugged in");
  }
  v4l2_capability capability{};
  if (call(fd, VIDIOC_QUERYCAP, &capability) < 0) return fail("not a camera", path.string(), "name a video device");
  const std::uint32_t able =
      (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps : capability.capabilities;
  if ((able & V4L2_CAP_VIDEO_CAPTURE) == 0 || (able & V4L2_CAP_STREAMING) == 0)
    return fail("the device gives no pictures", path.string(), "a camera may have several devices; try the next");
  device.card_ = reinterpret_cast<const char*>(capability.card);
  device.identity_ = device.card_ + " at " + reinterpret_cast<const char*>(capability.bus_info);
  return device;
}

V4l2Device::V4l2Device(V4l2Device&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)),
      path_(std::move(other.path_)),
      identity_(std::move(other.identity_)),
      card_(std::move(other.card_)),
      mappings_(std::exchange(other.mappings_, {})) {}

V4l2Device& V4l2Device::operator=(V4l2Device&& other) noexcept {
  std::swap(fd_, other.fd_);
  std::swap(path_, other.path_);
  std::swap(identity_, other.identity_);
  std::swap(card_, other.card_);
  std::swap(mappings_, other.mappings_);
  return *this;
}

V4l2Device::~V4l2Device() {
  unmap();
  if (fd_ >= 0) ::close(fd_);
}

void V4l2Device::unmap() {
  for (const Mapping& mapping : mappings_) ::munmap(mapping.start, mapping.length);
  mappings_.clear();
}

tl::unexpected<Error> V4l2Device::error(const std::string& what) const {
  const int code = errno;
  if (code == ENODEV) return fail("the device is gone", path_.string(), "plug it in again");
  return fail(what, path_.string() + " (" + std::strerror(code) + ")",
              code == EBUSY ? "end the other program that uses it" : "");
}

double V4l2Device::best_fps(const V4l2Mode& mode) const {
  v4l2_frmivalenum interval{};
  interval.pixel_format = mode.format;
  interval.width = static_cast<std::uint32_t>(mode.width);
  interval.height = static_cast<std::uint32_t>(mode.height);
  double best = 0.0;
  for (; call(fd_, VIDIOC_ENUM_FRAMEINTERVALS, &interval) == 0; ++interval.index) {
    if (interval.type != V4L2_FRMIVAL_TYPE_DISCRETE) return fps_of(interval.stepwise.min);
    best = std::max(best, fps_of(interval.discrete));
  }
  return best;
}

void V4l2Device::add_sizes(std::uint32_t format, std::vector<V4l2Mode>& modes) const {
  constexpr std::array<std::array<int, 2>, 5> usual = {
      {{{640, 480}}, {{1280, 720}}, {{1920, 1080}}, {{2560, 1440}}, {{3840, 2160}}}};
  v4l2_frmsizeenum size{};
  size.pixel_format = format;
  const auto add = [&](int width, int height) {
    V4l2Mode mode{.format = format, .width = width, .height = height};
    mode.fps = best_fps(mode);
    modes.push_back(mode);
  };
  for (; call(fd_, VIDIOC_ENUM_FRAMESIZES, &size) == 0; ++size.index) {
    if (size.type == V4L2_FRMSIZE_TYPE_DISCRETE) {
      add(static_cast<int>(size.discrete.width), static_cast<int>(size.discrete.height));
      continue;
    }
    for (const auto& [width, height] : usual) {
      if (is_within(size.stepwise, width, height)) add(width, height);
    }
    return;
  }
}

std::vector<V4l2Mode> V4l2Device::modes() const {
  std::vector<V4l2Mode> modes;
  v4l2_fmtdesc description{};
  description.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  for (; call(fd_, VIDIOC_ENUM_FMT, &description) == 0; ++description.index) {
    if (std::find(known_formats.begin(), known_formats.end(), description.pixelformat) != known_formats.end())
      add_sizes(description.pixelformat, modes);
  }
  return modes;
}

Result<V4l2Device::Layout> V4l2Device::set_mode(const V4l2Mode& mode) {
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  format.fmt.pix.pixelformat = mode.format;
  format.fmt.pix.width = static_cast<std::uint32_t>(mode.width);
  format.fmt.pix.height = static_cast<std::uint32_t>(mode.height);
  if (call(fd_, VIDIOC_S_FMT, &format) < 0) return error("the camera refuses its picture format");
  const v4l2_pix_format& set = format.fmt.pix;
  if (set.pixelformat != mode.format)
    return fail("the camera gives another picture format than asked for",
                path_.string() + ", " + format_name(set.pixelformat) + " in place of " + format_name(mode.format));
  v4l2_streamparm rate{};
  rate.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (mode.fps > 0.0) {
    constexpr double precision = 1000.0;
    constexpr double enough = 30.0;  // frames a second: more only costs
    rate.parm.capture.timeperframe = {static_cast<std::uint32_t>(precision),
                                      static_cast<std::uint32_t>(std::lround(precision * std::min(mode.fps, enough)))};
    call(fd_, VIDIOC_S_PARM, &rate);
  }
  if (call(fd_, VIDIOC_G_PARM, &rate) < 0) rate.parm.capture.timeperframe = {};
  return Layout{.format = set.pixelformat,
                .width = static_cast<int>(set.width),
                .height = static_cast<int>(set.height),
                .bytes_per_line = static_cast<int>(set.bytesperline),
                .fps = fps_of(rate.parm.capture.timeperframe)};
}

Result<int> V4l2Device::make_buffers(int count) {
  unmap();
  v4l2_requestbuffers request{};
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  request.count = static_cast<std::uint32_t>(count);
  if (call(fd_, VIDIOC_REQBUFS, &request) < 0) return error("no buffers for pictures");
  const int made = count == 0 ? 0 : static_cast<int>(request.count);
  for (int i = 0; i < made; ++i) {
    v4l2_buffer buffer = buffer_of(i);
    if (call(fd_, VIDIOC_QUERYBUF, &buffer) < 0) return error("no buffers for pictures");
    void* const start = ::mmap(nullptr, buffer.length, PROT_READ, MAP_SHARED, fd_, buffer.m.offset);
    if (start == MAP_FAILED) return error("buffers of the camera cannot be read");
    mappings_.push_back({start, buffer.length});
  }
  return made;
}

Result<void> V4l2Device::queue(int buffer) {
  v4l2_buffer queued = buffer_of(buffer);
  if (call(fd_, VIDIOC_QBUF, &queued) < 0) return error("the camera takes no buffer");
  return {};
}

Result<void> V4l2Device::stream_on() {
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (call(fd_, VIDIOC_STREAMON, &type) < 0) return error("the stream does not start");
  return {};
}

Result<void> V4l2Device::stream_off() {
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (call(fd_, VIDIOC_STREAMOFF, &type) < 0) return error("the stream does not stop");
  return {};
}

Result<bool> V4l2Device::wait(std::chrono::milliseconds timeout) {
  pollfd waited{.fd = fd_, .events = POLLIN, .revents = 0};
  const auto patience = std::clamp<std::int64_t>(timeout.count(), 0, std::numeric_limits<int>::max());
  const int ready = ::poll(&waited, 1, static_cast<int>(patience));
  if (ready < 0 && errno != EINTR) return error("the camera cannot be waited for");
  return ready > 0;
}

Result<std::optional<V4l2Device::Filled>> V4l2Device::dequeue() {
  v4l2_buffer buffer = buffer_of(0);
  if (call(fd_, VIDIOC_DQBUF, &buffer) < 0) {
    if (errno == EAGAIN) return std::nullopt;
    return error("the stream is broken");
  }
  constexpr double microseconds = 1e-6;
  const Mapping& mapping = mappings_.at(buffer.index);
  const std::size_t used = std::min<std::size_t>(buffer.bytesused, mapping.length);
  return Filled{.buffer = static_cast<int>(buffer.index),
                .bytes = {static_cast<const std::uint8_t*>(mapping.start), used},
                .damaged = (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0,
                .sequence = buffer.sequence,
                .stamp = static_cast<double>(buffer.timestamp.tv_sec) +
                         microseconds * static_cast<double>(buffer.timestamp.tv_usec)};
}

std::optional<std::int32_t> V4l2Device::control(std::uint32_t id) const {
  v4l2_queryctrl query{};
  query.id = id;
  if (call(fd_, VIDIOC_QUERYCTRL, &query) < 0 || (query.flags & V4L2_CTRL_FLAG_DISABLED) != 0) return std::nullopt;
  v4l2_control value{.id = id, .value = 0};
  if (call(fd_, VIDIOC_G_CTRL, &value) < 0) return std::nullopt;
  return value.value;
}

bool V4l2Device::set_control(std::uint32_t id, std::int32_t value) {
  v4l2_control control{.id = id, .value = value};
  return call(fd_, VIDIOC_S_CTRL, &control) == 0;
}

}  // namespace gyre
