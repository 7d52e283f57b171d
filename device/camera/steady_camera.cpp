// SPDX-License-Identifier: Apache-2.0
#include "device/camera/steady_camera.h"

#include <spdlog/spdlog.h>
#include <algorithm>
#include <cmath>
#include <utility>

namespace gyre {

namespace {

constexpr double milliseconds = 1e-3;

CameraCounters sum(const CameraCounters& a, const CameraCounters& b) {
  return {.queued = a.queued + b.queued,
          .completed = a.completed + b.completed,
          .cancelled = a.cancelled + b.cancelled,
          .torn = a.torn + b.torn,
          .missed = a.missed + b.missed,
          .stray = a.stray + b.stray,
          .restarts = a.restarts + b.restarts,
          .reopenings = a.reopenings + b.reopenings};
}

class SteadyCamera : public CameraDevice {
 public:
  SteadyCamera(std::unique_ptr<CameraDevice> camera, CameraFactory open, std::shared_ptr<CameraClock> clock,
               const SteadyOptions& options)
      : open_(std::move(open)),
        clock_(std::move(clock)),
        camera_(std::move(camera)),
        info_(camera_->info()),
        ladder_(options.ladder) {}

  const CameraInfo& info() const override { return info_; }

  Result<void> start() override {
    if (started_) return {};
    if (!camera_) {
      if (const Result<void> opened = reopen(); !opened) return opened;
    }
    if (const Result<void> begun = camera_->start(); !begun) return begun;
    started_ = true;
    count_ = 0;
    first_.reset();
    shift_ = 0.0;
    ladder_.started(clock_->now());
    return {};
  }

  void stop() override {
    started_ = false;
    if (camera_) camera_->stop();
  }

  Result<CameraEvent> next(std::chrono::milliseconds timeout) override {
    if (!started_) return fail("the camera is not started", info_.name);
    const double until = clock_->now() + milliseconds * static_cast<double>(timeout.count());
    for (;;) {
      Result<CameraEvent> event = ask(until);
      if (event && event->kind == CameraEvent::Kind::ended) return event;
      if (event && event->kind == CameraEvent::Kind::frame) return CameraEvent{event->kind, taken(*event->frame)};

      if (!event) last_error_ = event.error();
      LadderStep step = event ? ladder_.silent(clock_->now()) : ladder_.failed(clock_->now());
      while (step != LadderStep::none) {
        if (step == LadderStep::give_up) return given_up();
        const Result<void> climbed = climb(step);
        if (climbed) break;
        last_error_ = climbed.error();
        step = ladder_.failed(clock_->now());
      }
      if (clock_->now() >= until) return CameraEvent{CameraEvent::Kind::timeout, std::nullopt, ladder_.recovering()};
      // A camera that fails at once must not keep a core busy.
      if (!event) clock_->wait(least_wait);
    }
  }

  void lock(std::chrono::milliseconds patience) override {
    patience_ = patience;
    if (camera_) camera_->lock(patience);
  }

  void unlock() override {
    patience_.reset();
    if (camera_) camera_->unlock();
  }

  CameraLock locked() const override {
    if (camera_) return camera_->locked();
    return patience_ ? CameraLock::settling : CameraLock::automatic;
  }

  std::optional<double> clock_offset() const override { return camera_ ? camera_->clock_offset() : std::nullopt; }
  std::optional<double> time_zero() const override {
    const std::optional<double> zero = camera_ ? camera_->time_zero() : std::nullopt;
    return zero ? std::optional(*zero - shift_) : std::nullopt;
  }
  CameraCounters counters() const override { return camera_ ? sum(counters_, camera_->counters()) : counters_; }

 private:
  static constexpr double least_wait = 0.01;  // seconds

  // A frame of the camera, as long as there is one and the ladder has nothing to do.
  Result<CameraEvent> ask(double until) {
    const double now = clock_->now();
    const double patience = std::max(0.0, std::min(until, ladder_.next_step()) - now);
    if (camera_) return camera_->next(std::chrono::milliseconds(std::llround(std::ceil(patience / milliseconds))));
    clock_->wait(patience);
    return CameraEvent{};
  }

  // The frame as one of the scan.
  Frame taken(Frame& frame) {
    const double now = clock_->now();
    ladder_.frame(now);
    last_error_.reset();
    if (!said_.empty()) spdlog::info("{}: frames come again", info_.name);
    said_.clear();
    if (!first_) first_ = now - frame.time;
    if (frame.index == 0 && count_ > 0) shift_ = std::max(now - *first_, last_time_ + least_wait) - frame.time;
    frame.index = count_++;
    frame.time += shift_;
    last_time_ = frame.time;
    return std::move(frame);
  }

  Result<void> climb(LadderStep step) {
    const std::string trouble = last_error_ ? last_error_->what : "no frames come";
    // Once for each kind of trouble: a camera may be away for long.
    const auto level = std::exchange(said_, trouble) == trouble ? spdlog::level::debug : spdlog::level::warn;
    if (step == LadderStep::restart && camera_) {
      ++counters_.restarts;
      spdlog::log(level, "{}: {}, starting its stream again", info_.name, trouble);
      camera_->stop();
      return camera_->start();
    }
    ++counters_.reopenings;
    spdlog::log(level, "{}: {}, opening it again", info_.name, trouble);
    if (const Result<void> opened = reopen(); !opened) return opened;
    return camera_->start();
  }

  Result<void> reopen() {
    if (camera_) {
      camera_->stop();
      counters_ = sum(counters_, camera_->counters());
      camera_.reset();
    }
    Result<std::unique_ptr<CameraDevice>> opened = open_();
    if (!opened) return tl::unexpected(opened.error());
    const CameraInfo& found = (*opened)->info();
    if (found.width != info_.width || found.height != info_.height)
      return fail("another camera has come back",
                  info_.name + ", " + std::to_string(found.width) + "x" + std::to_string(found.height),
                  "plug in the one the scan began with");
    camera_ = std::move(*opened);
    if (patience_) camera_->lock(*patience_);
    return {};
  }

  tl::unexpected<Error> given_up() const {
    return fail("the camera does not come back",
                info_.name + (last_error_ ? " (" + last_error_->message() + ")" : std::string()),
                "check its cable and power");
  }

  CameraFactory open_;
  std::shared_ptr<CameraClock> clock_;
  std::unique_ptr<CameraDevice> camera_;  // none while it cannot be opened
  CameraInfo info_;
  FaultLadder ladder_;
  CameraCounters counters_;  // of devices that were closed
  std::optional<Error> last_error_;
  std::string said_;                                   // of the trouble there is
  std::optional<std::chrono::milliseconds> patience_;  // of the lock that was asked for
  bool started_ = false;
  int count_ = 0;
  double shift_ = 0.0;           // from the device's time to the scan's
  double last_time_ = 0.0;       // of the scan
  std::optional<double> first_;  // when the scan's time was 0
};

}  // namespace

Result<void> SteadyOptions::check() const {
  return ladder.check();
}

Result<std::unique_ptr<CameraDevice>> open_steady_camera(CameraFactory open, std::shared_ptr<CameraClock> clock,
                                                         const SteadyOptions& options) {
  if (const Result<void> valid = options.check(); !valid) return tl::unexpected(valid.error());
  Result<std::unique_ptr<CameraDevice>> camera = open();
  if (!camera) return camera;
  return std::make_unique<SteadyCamera>(std::move(*camera), std::move(open), std::move(clock), options);
}

}  // namespace gyre
