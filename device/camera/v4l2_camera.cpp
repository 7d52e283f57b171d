// SPDX-License-Identifier: Apache-2.0
#include "device/camera/v4l2_camera.h"

#include "device/camera/encode_pool.h"
#include "device/camera/jpeg.h"
#include "device/camera/sensor_clock.h"
#include "device/camera/settle_watch.h"
#include "device/camera/v4l2_device.h"

#include <spdlog/spdlog.h>
#include <algorithm>
#include <array>
#include <opencv2/core.hpp>
#include <utility>

namespace gyre {

namespace {

namespace fs = std::filesystem;

// What holds one property: a switch between automatic and manual, and the value that counts when it is manual.
struct Held {
  std::uint32_t automatic;
  std::int32_t off;
  std::uint32_t value;
};
constexpr std::array<Held, 4> held_controls = {
    {{V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL, V4L2_CID_EXPOSURE_ABSOLUTE},
     {V4L2_CID_AUTOGAIN, 0, V4L2_CID_GAIN},
     {V4L2_CID_AUTO_WHITE_BALANCE, 0, V4L2_CID_WHITE_BALANCE_TEMPERATURE},
     {V4L2_CID_FOCUS_AUTO, 0, V4L2_CID_FOCUS_ABSOLUTE}}};

RawPicture::Format raw_format(std::uint32_t format) {
  return format == V4L2_PIX_FMT_NV12 ? RawPicture::Format::nv12 : RawPicture::Format::yuyv;
}

class V4l2Camera : public CameraDevice {
 public:
  V4l2Camera(V4l2Device device, const V4l2Device::Layout& layout, const CameraName& name)
      : device_(std::move(device)), layout_(layout), wanted_buffers_(name.buffers) {
    constexpr double usual_fps = 30.0;
    info_ = {.name = "v4l2:" + name.target,
             .width = layout.width,
             .height = layout.height,
             .fps = layout.fps > 0.0 ? layout.fps : usual_fps,
             .live = true};
  }
  ~V4l2Camera() override { stop(); }

  const CameraInfo& info() const override { return info_; }

  Result<void> start() override {
    if (started_) return {};
    const Result<int> made = device_.make_buffers(wanted_buffers_);
    if (!made) return tl::unexpected(made.error());
    queued_.assign(static_cast<std::size_t>(*made), false);
    started_ = true;  // from here on stop() has something to give back
    count_ = 0;
    first_stamp_.reset();
    last_sequence_.reset();
    clock_.restart();
    settle_.restart();
    for (int i = 0; i < *made; ++i) {
      if (const Result<void> queued = queue(i); !queued) return stopped(queued.error());
    }
    if (const Result<void> on = device_.stream_on(); !on) return stopped(on.error());
    return {};
  }

  void stop() override {
    if (!std::exchange(started_, false)) return;
    // Of a device that is gone the kernel has let go of everything itself.
    if (const Result<void> off = device_.stream_off(); !off) spdlog::debug("{}", off.error().message());
    counters_.cancelled += std::count(queued_.begin(), queued_.end(), true);
    queued_.clear();
    if (const Result<int> freed = device_.make_buffers(0); !freed) spdlog::debug("{}", freed.error().message());
  }

  Result<CameraEvent> next(std::chrono::milliseconds timeout) override {
    if (!started_) return fail("the camera is not started", info_.name);
    const auto until = std::chrono::steady_clock::now() + timeout;
    for (;;) {
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - std::chrono::steady_clock::now());
      const Result<bool> ready = device_.wait(std::max(left, std::chrono::milliseconds(0)));
      if (!ready) return tl::unexpected(ready.error());
      if (*ready) {
        Result<std::optional<Frame>> frame = take();
        if (!frame) return tl::unexpected(frame.error());
        if (*frame) {
          hold_when_settled(**frame);
          return CameraEvent{CameraEvent::Kind::frame, std::move(*frame)};
        }
      }
      if (std::chrono::steady_clock::now() >= until) return CameraEvent{};
    }
  }

  void lock(std::chrono::milliseconds patience) override {
    lock_ = CameraLock::settling;
    settle_.begin(patience);
  }

  void unlock() override {
    for (const auto& [control, value] : automatic_) device_.set_control(control, value);
    automatic_.clear();
    settings_ = {};
    lock_ = CameraLock::automatic;
  }

  CameraLock locked() const override { return lock_; }
  std::optional<double> clock_offset() const override { return clock_.offset(); }
  std::optional<double> time_zero() const override {
    if (!first_stamp_ || !clock_.offset()) return std::nullopt;
    return *first_stamp_ + *clock_.offset();
  }
  CameraCounters counters() const override { return counters_; }

 private:
  Result<void> queue(int buffer) {
    const Result<void> queued = device_.queue(buffer);
    if (!queued) return queued;
    queued_.at(static_cast<std::size_t>(buffer)) = true;
    ++counters_.queued;
    return {};
  }

  tl::unexpected<Error> stopped(const Error& error) {
    stop();
    return tl::unexpected(error);
  }

  // The next frame that is whole; nothing when there is none now.
  Result<std::optional<Frame>> take() {
    const Result<std::optional<V4l2Device::Filled>> dequeued = device_.dequeue();
    if (!dequeued) return tl::unexpected(dequeued.error());
    if (!*dequeued) return std::nullopt;
    const V4l2Device::Filled& filled = **dequeued;
    const auto buffer = static_cast<std::size_t>(filled.buffer);
    if (!queued_.at(buffer)) ++counters_.stray;
    queued_[buffer] = false;
    ++counters_.completed;
    if (last_sequence_ && filled.sequence > *last_sequence_ + 1)
      counters_.missed += filled.sequence - *last_sequence_ - 1;
    last_sequence_ = filled.sequence;
    clock_.add(filled.stamp, monotonic_now(), boot_now());

    std::optional<Frame> frame;
    std::string jpeg;
    RawPicture raw;
    const bool is_jpeg = layout_.format == V4L2_PIX_FMT_MJPEG;
    if (!filled.damaged && is_jpeg) jpeg.assign(filled.bytes.begin(), filled.bytes.end());
    if (!filled.damaged && !is_jpeg) raw = copy_of(filled.bytes);
    // What is wanted has been copied: the camera gets its buffer back before anything else is done.
    if (const Result<void> queued = queue(filled.buffer); !queued) return tl::unexpected(queued.error());
    if (is_jpeg) {
      frame = compressed(std::move(jpeg));
    } else {
      frame = uncompressed(std::move(raw));
    }
    if (!frame) return frame;
    if (!first_stamp_) first_stamp_ = filled.stamp;
    frame->index = count_++;
    frame->time = filled.stamp - *first_stamp_;
    frame->settings = settings_;
    return frame;
  }

  std::optional<Frame> compressed(std::string jpeg) {
    Result<cv::Mat> image = cut_and_decode_jpeg(jpeg, analysis_side);
    if (!image) {
      ++counters_.torn;
      spdlog::debug("{}: {}", info_.name, image.error().message());
      return std::nullopt;
    }
    return Frame{
        .index = 0, .time = 0.0, .image = std::move(*image), .jpeg = std::move(jpeg), .full = nullptr, .settings = {}};
  }

  std::optional<Frame> uncompressed(RawPicture raw) {
    if (raw.bytes.empty()) {
      ++counters_.torn;
      return std::nullopt;
    }
    cv::Mat image = reduced_bgr(raw, analysis_side);
    std::shared_ptr<const FullPicture> full = pool_.keep(std::move(raw));
    if (!full) {
      ++counters_.missed;
      return std::nullopt;
    }
    return Frame{
        .index = 0, .time = 0.0, .image = std::move(image), .jpeg = {}, .full = std::move(full), .settings = {}};
  }

  // Without what the driver pads rows with; empty when there is too little of it.
  RawPicture copy_of(std::span<const std::uint8_t> bytes) const {
    const RawPicture::Format format = raw_format(layout_.format);
    const bool planar = format == RawPicture::Format::nv12;
    const auto row = static_cast<std::size_t>(planar ? layout_.width : 2 * layout_.width);
    const auto stride = std::max(row, static_cast<std::size_t>(layout_.bytes_per_line));
    const auto rows = static_cast<std::size_t>(planar ? layout_.height / 2 * 3 : layout_.height);
    RawPicture raw{.format = format, .width = layout_.width, .height = layout_.height, .bytes = {}};
    if (bytes.size() < stride * (rows - 1) + row) return raw;
    raw.bytes.reserve(row * rows);
    for (std::size_t y = 0; y < rows; ++y) {
      const auto from = bytes.begin() + static_cast<std::ptrdiff_t>(y * stride);
      raw.bytes.insert(raw.bytes.end(), from, from + static_cast<std::ptrdiff_t>(row));
    }
    return raw;
  }

  void hold_when_settled(const Frame& frame) {
    if (lock_ != CameraLock::settling) return;
    const cv::Scalar mean = cv::mean(frame.image);
    const bool settled = settle_.add(frame.time, (mean[0] + mean[1] + mean[2]) / 3.0);
    if (!settled && !settle_.is_late()) return;
    if (!settled) spdlog::warn("{}: the exposure does not settle, held as it is", info_.name);
    hold();
  }

  void hold() {
    for (const Held& property : held_controls) {
      const std::optional<std::int32_t> automatic = device_.control(property.automatic);
      const std::optional<std::int32_t> value = device_.control(property.value);
      if (!automatic) continue;
      if (*automatic != property.off) {
        if (!device_.set_control(property.automatic, property.off)) continue;
        automatic_.emplace_back(property.automatic, *automatic);
      }
      // What the automatic had found; some cameras fall back to their default otherwise.
      if (value) device_.set_control(property.value, *value);
    }
    constexpr double exposure_unit = 1e-4;  // seconds
    const std::optional<std::int32_t> exposure = device_.control(V4L2_CID_EXPOSURE_ABSOLUTE);
    const std::optional<std::int32_t> gain = device_.control(V4L2_CID_GAIN);
    if (exposure) settings_.exposure_s = exposure_unit * *exposure;
    if (gain) settings_.gain = *gain;
    lock_ = CameraLock::held;
    spdlog::info("{}: held, exposure {} s, gain {}", info_.name, settings_.exposure_s.value_or(0.0),
                 settings_.gain.value_or(0.0));
  }

  V4l2Device device_;
  V4l2Device::Layout layout_;
  CameraInfo info_;
  EncodePool pool_;
  CameraCounters counters_;
  int wanted_buffers_;
  std::vector<bool> queued_;  // by buffer
  bool started_ = false;
  int count_ = 0;
  std::optional<double> first_stamp_;
  std::optional<std::uint32_t> last_sequence_;
  SensorClock clock_;

  CameraLock lock_ = CameraLock::automatic;
  SettleWatch settle_;
  std::vector<std::pair<std::uint32_t, std::int32_t>> automatic_;  // what unlock() sets back
  FrameSettings settings_;
};

// The device of a camera that may have come back under another number.
Result<V4l2Device> find_device(const fs::path& path, const std::string& identity) {
  Result<V4l2Device> device = V4l2Device::open(path);
  if (identity.empty() || (device && device->identity() == identity)) return device;
  std::error_code error;
  for (fs::directory_iterator it("/dev", error), end; !error && it != end; it.increment(error)) {
    if (!it->path().filename().string().starts_with("video")) continue;
    Result<V4l2Device> other = V4l2Device::open(it->path());
    if (other && other->identity() == identity) return other;
  }
  if (!device) return device;
  return fail("another camera is there", path.string() + ", " + device->identity(), "plug in " + identity);
}

std::uint32_t format_code(const std::string& name) {
  if (name == "NV12") return V4L2_PIX_FMT_NV12;
  if (name == "YUYV") return V4L2_PIX_FMT_YUYV;
  return name == "MJPG" ? V4L2_PIX_FMT_MJPEG : 0;
}

}  // namespace

Result<std::unique_ptr<CameraDevice>> open_v4l2_camera(const CameraName& name, std::string& identity) {
  Result<V4l2Device> device = find_device(name.target, identity);
  if (!device) return tl::unexpected(device.error());
  const std::vector<V4l2Mode> modes = device->modes();
  const std::optional<V4l2Mode> mode = choose_mode(modes, format_code(name.format), name.width, name.height);
  if (!mode)
    return fail("the camera has no picture format that can be used", name.target + ", " + device->card(),
                name.format.empty() ? "it must give MJPEG, NV12 or YUYV" : "leave the format to the camera");
  const Result<V4l2Device::Layout> layout = device->set_mode(*mode);
  if (!layout) return tl::unexpected(layout.error());
  spdlog::info("{} ({}): {} {}x{}, {} frames a second", name.target, device->card(), format_name(layout->format),
               layout->width, layout->height, layout->fps);
  if (layout->width != mode->width || layout->height != mode->height)
    spdlog::warn("{}: {}x{} was asked for", name.target, mode->width, mode->height);
  identity = device->identity();
  return std::make_unique<V4l2Camera>(std::move(*device), *layout, name);
}

}  // namespace gyre
