// SPDX-License-Identifier: Apache-2.0
#include "device/camera/faulty_replay.h"

#include "common/selection/ingest.h"
#include "device/camera/jpeg.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace gyre {

// The recording, the faults and which of them there is now.
class FaultyReplay::Rig {
 public:
  Rig(std::unique_ptr<CameraDevice> recording, std::vector<Fault> faults, std::shared_ptr<CameraClock> clock)
      : recording_(std::move(recording)), faults_(std::move(faults)), clock_(std::move(clock)) {}

  const CameraInfo& recording() const { return recording_->info(); }

  Result<int> open() {
    if (now_wrong_ && now_wrong_->until == Fault::Until::reopen) cure();
    if (is_gone()) return absent();
    return ++opened_;
  }

  Result<void> start(int handle) {
    if (handle != opened_ || is_gone()) return absent();
    if (now_wrong_ && now_wrong_->until == Fault::Until::restart) cure();
    if (disturbed_) return {};
    recording_->stop();
    waiting_.reset();
    next_fault_ = 0;
    missing_ = torn_ = 0;
    begin_ = origin_ = clock_->now();
    return recording_->start();
  }

  // A frame with the time since the recording began, pauses included.
  Result<CameraEvent> next(int handle, std::chrono::milliseconds timeout, CameraCounters& counters) {
    const double until = clock_->now() + std::chrono::duration<double>(timeout).count();
    for (;;) {
      if (handle != opened_) return absent();
      if (now_wrong_) {
        if (now_wrong_->kind == Fault::Kind::gone) return absent();
        const bool over = ends_ <= clock_->now();
        if (!over && now_wrong_->kind == Fault::Kind::broken) return fail("the stream is broken", recording().name);
        if (!over && !wait(ends_, until)) return CameraEvent{};
        cure();
      }
      if (!waiting_) {
        Result<CameraEvent> event = recording_->next(timeout);
        if (!event || event->kind != CameraEvent::Kind::frame) return event;
        waiting_ = std::move(event->frame);
        ++counters.queued;
      }
      if (const Fault* const fault = due()) {
        begin(*fault);
        continue;
      }
      if (!wait(begin_ + waiting_->time, until)) return CameraEvent{};
      Frame frame = *std::exchange(waiting_, std::nullopt);
      ++counters.completed;
      if (missing_ > 0) {
        --missing_;
        ++counters.missed;
        continue;
      }
      Result<std::string> jpeg = keyframe_jpeg(frame);
      if (!jpeg) return tl::unexpected(jpeg.error());
      if (torn_ > 0) {
        --torn_;
        jpeg->resize(jpeg->size() / 2);
      }
      if (!decode_jpeg(*jpeg, 1)) {
        ++counters.torn;
        continue;
      }
      frame.jpeg = std::move(*jpeg);
      disturbed_ = false;
      frame.time += begin_ - origin_;  // when it was taken, however late it is
      return CameraEvent{CameraEvent::Kind::frame, std::move(frame)};
    }
  }

 private:
  tl::unexpected<Error> absent() const { return fail("the device is gone", recording().name); }

  bool is_gone() {
    if (!now_wrong_ || now_wrong_->kind != Fault::Kind::gone) return false;
    if (clock_->now() < ends_) return true;
    cure();
    return false;
  }

  // Until `when`, or in vain until `until`.
  bool wait(double when, double until) {
    clock_->wait(std::min(when, until) - clock_->now());
    return when <= until;
  }

  const Fault* due() const {
    if (next_fault_ == faults_.size() || faults_[next_fault_].before_frame > waiting_->index) return nullptr;
    return &faults_[next_fault_];
  }

  void begin(const Fault& fault) {
    ++next_fault_;
    disturbed_ = true;
    if (fault.kind == Fault::Kind::missing) {
      missing_ = fault.frames;
    } else if (fault.kind == Fault::Kind::torn) {
      torn_ = fault.frames;
    } else {
      now_wrong_ = fault;
      began_ = std::max(clock_->now(), begin_ + waiting_->time);
      ends_ = fault.until == Fault::Until::time ? began_ + fault.seconds : std::numeric_limits<double>::infinity();
    }
  }

  void cure() {
    const double stood_still = std::max(0.0, clock_->now() - began_);
    // What is only late catches up.
    if (now_wrong_->kind != Fault::Kind::late) begin_ += stood_still;
    now_wrong_.reset();
  }

  std::unique_ptr<CameraDevice> recording_;
  std::vector<Fault> faults_;
  std::shared_ptr<CameraClock> clock_;
  std::optional<Frame> waiting_;  // read, not delivered yet
  std::optional<Fault> now_wrong_;
  std::size_t next_fault_ = 0;
  double origin_ = 0.0;  // when the recording was begun
  double begin_ = 0.0;   // the same, later by the time it stood still
  double began_ = 0.0;   // what is wrong now
  double ends_ = 0.0;
  int missing_ = 0;
  int torn_ = 0;
  int opened_ = 0;
  bool disturbed_ = false;  // by a fault since the last frame: who starts anew wants to go on
};

class FaultyReplay::Handle : public CameraDevice {
 public:
  Handle(std::shared_ptr<Rig> rig, int number) : rig_(std::move(rig)), number_(number), info_(rig_->recording()) {
    info_.live = true;
  }

  const CameraInfo& info() const override { return info_; }

  Result<void> start() override {
    if (started_) return {};
    if (const Result<void> begun = rig_->start(number_); !begun) return begun;
    started_ = true;
    count_ = 0;
    return {};
  }

  void stop() override {
    if (!std::exchange(started_, false)) return;
    counters_.cancelled = counters_.queued - counters_.completed;
  }

  Result<CameraEvent> next(std::chrono::milliseconds timeout) override {
    if (!started_) return fail("the camera is not started", info_.name);
    Result<CameraEvent> event = rig_->next(number_, timeout, counters_);
    if (!event || !event->frame) return event;
    if (count_ == 0) first_time_ = event->frame->time;
    event->frame->index = count_++;
    event->frame->time -= first_time_;
    return event;
  }

  CameraCounters counters() const override { return counters_; }

 private:
  std::shared_ptr<Rig> rig_;
  int number_;
  CameraInfo info_;
  CameraCounters counters_;
  bool started_ = false;
  int count_ = 0;
  double first_time_ = 0.0;
};

FaultyReplay::FaultyReplay(std::unique_ptr<CameraDevice> recording, std::vector<Fault> faults,
                           std::shared_ptr<CameraClock> clock)
    : rig_(std::make_shared<Rig>(std::move(recording), std::move(faults), std::move(clock))) {}

FaultyReplay::~FaultyReplay() = default;

Result<std::unique_ptr<CameraDevice>> FaultyReplay::open() {
  const Result<int> number = rig_->open();
  if (!number) return tl::unexpected(number.error());
  return std::make_unique<Handle>(rig_, *number);
}

}  // namespace gyre
