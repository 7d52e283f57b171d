// SPDX-License-Identifier: Apache-2.0
#include "device/camera/libcamera_camera.h"

#include "device/camera/encode_pool.h"
#include "device/camera/jpeg.h"
#include "device/camera/libcamera_opened.h"
#include "device/camera/libcamera_shim.h"
#include "device/camera/libcamera_streams.h"
#include "device/camera/sensor_clock.h"
#include "device/camera/settle_watch.h"

#include <libcamera/libcamera.h>
#include <spdlog/spdlog.h>
#include <algorithm>
#include <cstring>
#include <opencv2/core.hpp>
#include <utility>

namespace gyre {

namespace {

namespace lc = libcamera;
namespace ids = libcamera::controls;

class LibcameraCamera : public CameraDevice {
 public:
  LibcameraCamera(std::shared_ptr<lc::CameraManager> keeper, std::shared_ptr<lc::Camera> camera)
      : opened_(std::make_unique<OpenedLibcamera>(std::move(keeper), std::move(camera))) {}

  ~LibcameraCamera() override { stop(); }

  Result<void> open(const CameraName& name) {
    if (const Result<void> acquired = opened_->acquire(); !acquired) return acquired;
    if (const Result<void> configured = configure(name); !configured) return configured;
    if (const Result<void> allocated = opened_->allocate(); !allocated) return allocated;
    info_.name = "libcamera:" + camera().id();
    info_.width = static_cast<int>(main().size.width);
    info_.height = static_cast<int>(main().size.height);
    info_.fps = fps();
    info_.live = true;
    return {};
  }

  const CameraInfo& info() const override { return info_; }

  Result<void> start() override {
    if (started_) return {};
    if (!opened_ || opened_->gone()) return fail("the device is gone", info_.name, "plug it in again");
    count_ = 0;
    first_stamp_.reset();
    last_sequence_.reset();
    clock_.restart();
    settle_.restart();
    lc::ControlList controls(camera().controls());
    if (held_) controls.merge(*held_);
    if (const int error = camera().start(&controls); error != 0)
      return fail("the stream does not start", info_.name + " (" + std::strerror(-error) + ")");
    started_ = true;
    for (const auto& request : opened_->requests) {
      request->reuse(lc::Request::ReuseBuffers);
      if (const Result<void> queued = queue(*request); !queued) {
        stop();
        return queued;
      }
    }
    return {};
  }

  // libcamera hands back all requests before this returns.
  void stop() override {
    if (!std::exchange(started_, false)) return;
    if (opened_->gone()) {
      opened_->arrivals.write_off();
      counters_ = counters();
      abandon(std::move(opened_));
      return;
    }
    camera().stop();
    opened_->arrivals.clear();
  }

  Result<CameraEvent> next(std::chrono::milliseconds timeout) override {
    if (!started_) return fail("the camera is not started", info_.name);
    const auto until = std::chrono::steady_clock::now() + timeout;
    for (;;) {
      const Result<lc::Request*> arrived = opened_->arrivals.next(until, info_.name);
      if (!arrived) return tl::unexpected(arrived.error());
      if (*arrived == nullptr) return CameraEvent{};
      lc::Request& request = **arrived;
      std::optional<Frame> frame = take(request);
      if (frame) hold_when_settled(*frame, request.metadata());
      request.reuse(lc::Request::ReuseBuffers);
      if (next_controls_) request.controls().merge(*std::exchange(next_controls_, std::nullopt));
      if (const Result<void> queued = queue(request); !queued) return tl::unexpected(queued.error());
      if (frame) return CameraEvent{CameraEvent::Kind::frame, std::move(*frame)};
    }
  }

  void lock(std::chrono::milliseconds patience) override {
    lock_ = CameraLock::settling;
    settle_.begin(patience);
  }

  void unlock() override {
    if (lock_ == CameraLock::held && opened_) {
      lc::ControlList controls(camera().controls());
      shim::free_exposure(controls, camera().controls());
      set(controls, ids::AwbEnable, true);
      set(controls, ids::AfMode, static_cast<std::int32_t>(ids::AfModeContinuous));
      next_controls_ = controls;
    }
    held_.reset();
    lock_ = CameraLock::automatic;
  }

  CameraLock locked() const override { return lock_; }
  std::optional<double> clock_offset() const override { return clock_.offset(); }
  std::optional<double> time_zero() const override {
    if (!first_stamp_ || !clock_.offset()) return std::nullopt;
    return *first_stamp_ + *clock_.offset();
  }

  CameraCounters counters() const override {
    CameraCounters counters = opened_ ? opened_->arrivals.counters() : counters_;
    if (opened_) {
      counters.torn = counters_.torn;
      counters.missed = counters_.missed;
    }
    return counters;
  }

 private:
  lc::Camera& camera() const { return *opened_->camera; }
  const lc::StreamConfiguration& main() const { return opened_->configuration->at(0); }
  bool has_two() const { return opened_->configuration->size() > 1; }

  Result<void> configure(const CameraName& name) {
    const StreamOffer offer = [&](const std::vector<lc::StreamRole>& roles) {
      return camera().generateConfiguration(roles);
    };
    Result<std::unique_ptr<lc::CameraConfiguration>> chosen = choose_streams(offer, name, camera().id());
    if (!chosen) return tl::unexpected(chosen.error());
    opened_->configuration = std::move(*chosen);
    if (const int error = camera().configure(opened_->configuration.get()); error != 0)
      return fail("the camera refuses its configuration",
                  camera().id() + ", " + text_of(*opened_->configuration) + " (" + std::strerror(-error) + ")");
    return {};
  }

  double fps() const {
    constexpr double usual = 30.0;
    constexpr double microseconds = 1e-6;
    const auto limits = camera().controls().find(&ids::FrameDurationLimits);
    if (limits == camera().controls().end()) return usual;
    const auto shortest = limits->second.min().get<std::int64_t>();
    return shortest > 0 ? 1.0 / (microseconds * static_cast<double>(shortest)) : usual;
  }

  Result<void> queue(lc::Request& request) {
    opened_->arrivals.queued(request.cookie());
    const int error = camera().queueRequest(&request);
    if (error == 0) return {};
    opened_->arrivals.refused(request.cookie());
    return fail("the camera takes no request", info_.name + " (" + std::strerror(-error) + ")");
  }

  // The frame of a request; nothing when it is damaged or has no room.
  std::optional<Frame> take(lc::Request& request) {
    constexpr double nanoseconds = 1e-9;
    const lc::FrameBuffer& buffer = *request.findBuffer(main().stream());
    const lc::FrameMetadata& metadata = buffer.metadata();
    if (last_sequence_ && metadata.sequence > *last_sequence_ + 1)
      counters_.missed += metadata.sequence - *last_sequence_ - 1;
    last_sequence_ = metadata.sequence;
    const double stamp = nanoseconds * static_cast<double>(metadata.timestamp);
    if (metadata.timestamp != 0) clock_.add(stamp, monotonic_now(), boot_now());
    std::optional<Frame> frame;
    if (metadata.status == lc::FrameMetadata::FrameSuccess) frame = read(request, buffer);
    if (!frame) {
      ++counters_.torn;
      return frame;
    }
    if (frame->jpeg.empty() && !frame->full) {
      ++counters_.missed;
      return std::nullopt;
    }
    if (!first_stamp_) first_stamp_ = stamp;
    frame->index = count_++;
    frame->time = stamp - *first_stamp_;
    frame->settings = settings_of(request.metadata());
    return frame;
  }

  std::optional<Frame> read(lc::Request& request, const lc::FrameBuffer& buffer) {
    Frame frame;
    const MappedBuffer& mapped = *opened_->buffers.at(&buffer);
    if (!readable(main().pixelFormat)->raw) {
      frame.jpeg = copy_jpeg(mapped, buffer.metadata().planes()[0].bytesused);
      Result<cv::Mat> image = cut_and_decode_jpeg(frame.jpeg, analysis_side);
      if (!image) return std::nullopt;
      frame.image = std::move(*image);
      return frame;
    }
    std::optional<RawPicture> raw = copy_raw(mapped, main());
    if (!raw) return std::nullopt;
    if (has_two()) {
      const lc::StreamConfiguration& small = opened_->configuration->at(1);
      const std::optional<RawPicture> reduced =
          copy_raw(*opened_->buffers.at(request.findBuffer(small.stream())), small);
      if (!reduced) return std::nullopt;
      frame.image = reduced_bgr(*reduced, analysis_side);
    } else {
      frame.image = reduced_bgr(*raw, analysis_side);
    }
    frame.full = pool_.keep(std::move(*raw));
    return frame;
  }

  static FrameSettings settings_of(const lc::ControlList& metadata) {
    constexpr double microseconds = 1e-6;
    FrameSettings settings;
    if (const auto exposure = metadata.get(ids::ExposureTime)) settings.exposure_s = microseconds * *exposure;
    if (const auto gain = metadata.get(ids::AnalogueGain)) settings.gain = *gain;
    if (const auto lens = metadata.get(ids::LensPosition)) settings.lens_position = *lens;
    return settings;
  }

  template <class T>
  void set(lc::ControlList& controls, const lc::Control<T>& control, const T& value) const {
    if (camera().controls().count(&control) != 0) controls.set(control, value);
  }

  void hold_when_settled(const Frame& frame, const lc::ControlList& metadata) {
    if (lock_ != CameraLock::settling) return;
    const cv::Scalar mean = cv::mean(frame.image);
    const bool rests = settle_.add(frame.time, (mean[0] + mean[1] + mean[2]) / 3.0);
    // The camera knows best; not all say.
    const bool exposed = shim::exposure_settled(metadata).value_or(rests);
    const auto focus = metadata.get(ids::AfState);
    const bool focused = !focus || *focus == ids::AfStateFocused || *focus == ids::AfStateIdle;
    if (!(exposed && focused) && !settle_.is_late()) return;
    if (!(exposed && focused)) spdlog::warn("{}: exposure or focus do not settle, held as they are", info_.name);
    hold(metadata);
  }

  // Everything as the automatics left it in the frame of this metadata.
  void hold(const lc::ControlList& metadata) {
    lc::ControlList controls(camera().controls());
    shim::hold_exposure(controls, camera().controls(), metadata.get(ids::ExposureTime),
                        metadata.get(ids::AnalogueGain));
    set(controls, ids::AwbEnable, false);
    if (const auto gains = metadata.get(ids::ColourGains); gains && camera().controls().count(&ids::ColourGains) != 0)
      controls.set(ids::ColourGains, *gains);
    set(controls, ids::AfMode, static_cast<std::int32_t>(ids::AfModeManual));
    if (const auto lens = metadata.get(ids::LensPosition)) set(controls, ids::LensPosition, *lens);
    held_ = controls;
    next_controls_ = controls;
    lock_ = CameraLock::held;
    const FrameSettings settings = settings_of(metadata);
    spdlog::info("{}: held, exposure {} s, gain {}", info_.name, settings.exposure_s.value_or(0.0),
                 settings.gain.value_or(0.0));
  }

  std::unique_ptr<OpenedLibcamera> opened_;  // none when the device went while it streamed
  CameraInfo info_;
  EncodePool pool_;
  CameraCounters counters_;  // what is not counted where requests arrive

  bool started_ = false;
  int count_ = 0;
  std::optional<double> first_stamp_;
  std::optional<std::uint32_t> last_sequence_;
  SensorClock clock_;

  CameraLock lock_ = CameraLock::automatic;
  SettleWatch settle_;
  std::optional<lc::ControlList> held_;           // also for the next start
  std::optional<lc::ControlList> next_controls_;  // for the next request
};

}  // namespace

Result<std::unique_ptr<CameraDevice>> open_libcamera(const CameraName& name) {
  const Result<std::shared_ptr<lc::CameraManager>> keeper = camera_manager();
  if (!keeper) return tl::unexpected(keeper.error());
  const std::vector<std::shared_ptr<lc::Camera>> cameras = (*keeper)->cameras();
  const auto found = std::find_if(cameras.begin(), cameras.end(), [&](const std::shared_ptr<lc::Camera>& camera) {
    return name.target.empty() || camera->id() == name.target;
  });
  if (found == cameras.end()) {
    std::string there;
    for (const auto& camera : cameras) there += (there.empty() ? "there are: " : ", ") + camera->id();
    return fail("no camera there", "libcamera:" + name.target, there.empty() ? "check that it is connected" : there);
  }
  auto camera = std::make_unique<LibcameraCamera>(*keeper, *found);
  if (const Result<void> opened = camera->open(name); !opened) return tl::unexpected(opened.error());
  return camera;
}

}  // namespace gyre
