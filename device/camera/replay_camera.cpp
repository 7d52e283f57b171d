// SPDX-License-Identifier: Apache-2.0
#include "device/camera/replay_camera.h"

#include "common/selection/ingest.h"

#include <thread>
#include <utility>

namespace gyre {

namespace {

using Clock = std::chrono::steady_clock;

class ReplayCamera : public CameraDevice {
 public:
  ReplayCamera(std::unique_ptr<FrameSource> source, Pace pace)
      : path_(source->info().path), pace_(pace), source_(std::move(source)) {
    const CaptureInfo& capture = source_->info();
    info_ = {.name = "replay:" + path_.string(),
             .width = capture.width,
             .height = capture.height,
             .fps = capture.fps,
             .expected_frames = capture.expected_frames,
             .photographs = is_photographs(capture),
             .focal_35mm = capture.focal_35mm};
  }

  const CameraInfo& info() const override { return info_; }

  Result<void> start() override {
    if (started_) return {};
    if (!source_) {
      Result<std::unique_ptr<FrameSource>> source = open_capture(path_);
      if (!source) return tl::unexpected(source.error());
      source_ = std::move(*source);
    }
    started_ = Clock::now();
    return {};
  }

  void stop() override {
    if (!started_) return;
    started_.reset();
    waiting_.reset();
    source_.reset();
  }

  Result<CameraEvent> next(std::chrono::milliseconds timeout) override {
    if (!started_) return fail("the camera is not started", info_.name);
    if (!waiting_) {
      Result<std::optional<Frame>> frame = source_->next();
      if (!frame) return tl::unexpected(frame.error());
      if (!*frame) return CameraEvent{CameraEvent::Kind::ended, std::nullopt};
      waiting_ = std::move(**frame);
    }
    if (pace_ == Pace::recorded && !info_.photographs) {
      const auto due =
          *started_ + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(waiting_->time));
      const auto patience = Clock::now() + timeout;
      std::this_thread::sleep_until(std::min(due, patience));
      if (due > patience) return CameraEvent{CameraEvent::Kind::timeout, std::nullopt};
    }
    return CameraEvent{CameraEvent::Kind::frame, std::exchange(waiting_, std::nullopt)};
  }

  Result<void> recall(const std::vector<int>& indices, const std::function<Result<void>(const Frame&)>& take) override {
    if (indices.empty()) return {};
    Result<std::unique_ptr<FrameSource>> source = open_capture(path_);
    if (!source) return tl::unexpected(source.error());
    auto wanted = indices.begin();
    while (wanted != indices.end()) {
      const Result<std::optional<Frame>> frame = (*source)->next();
      if (!frame) return tl::unexpected(frame.error());
      if (!*frame) return fail("the capture changed while it was read", path_.string(), "run again");
      if ((*frame)->index != *wanted) continue;
      if (const Result<void> taken = take(**frame); !taken) return taken;
      ++wanted;
    }
    return {};
  }

 private:
  std::filesystem::path path_;
  Pace pace_;
  CameraInfo info_;
  std::unique_ptr<FrameSource> source_;
  std::optional<Clock::time_point> started_;
  std::optional<Frame> waiting_;  // decoded, not due yet
};

}  // namespace

Result<std::unique_ptr<CameraDevice>> open_replay_camera(const std::filesystem::path& capture, Pace pace) {
  Result<std::unique_ptr<FrameSource>> source = open_capture(capture);
  if (!source) return tl::unexpected(source.error());
  return std::make_unique<ReplayCamera>(std::move(*source), pace);
}

}  // namespace gyre
