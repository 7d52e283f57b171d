// SPDX-License-Identifier: Apache-2.0
// A camera on a thread of its own: it never waits for whoever works on its frames.
#pragma once

#include "device/camera/camera_device.h"
#include "device/camera/fault_ladder.h"
#include "device/camera/steady_camera.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

namespace gyre {

// What a camera has to say.
struct PumpNews {
  std::optional<Frame> frame;
  bool has_ended = false;           // a recording; nothing more until arm()
  bool is_lost = false;             // no frames come now, and the camera is being brought back
  bool is_given_up = false;         // it will not come back
  std::optional<Error> trouble;     // why it is lost or given up, when that is known
  std::optional<double> time_zero;  // see CameraDevice
};

// Opens the camera, also when it is not there yet, and streams from then on. When frames are not taken in time, the
// oldest ones of a live camera are left out; a recording waits. Belongs to one thread, but for its own.
class FramePump {
 public:
  // ladder: patience and between_reopens hold for the first opening. options.check() must hold.
  explicit FramePump(CameraFactory open, const LadderOptions& ladder = {});
  ~FramePump();
  FramePump(const FramePump&) = delete;
  FramePump& operator=(const FramePump&) = delete;

  // The next frame, or other news when none comes within that time. Frames have the camera's numbers and times.
  PumpNews next(std::chrono::milliseconds timeout);

  // Of the camera, once it was open.
  std::optional<CameraInfo> info() const;
  CameraLock locked() const { return locked_; }
  std::int64_t left_out() const { return left_out_; }  // frames that nobody took in time

  // A recording begins anew with its first frame, and frames that wait are dropped; then exposure, gain, white balance
  // and focus settle anew and are held, see CameraDevice::lock. Error: the camera is away.
  Result<void> arm(std::chrono::milliseconds patience);
  // Leaves them to the camera again.
  void disarm();

  // Does something with the camera between two frames. Errors: those of the task, and that the camera is away.
  Result<void> with(const std::function<Result<void>(CameraDevice&)>& task);

 private:
  void run();
  bool open();
  void stream();
  void push(Frame frame);
  void note_time_zero();
  void tell(bool is_lost, const std::optional<Error>& trouble);
  void do_tasks(std::unique_lock<std::mutex>& lock);

  CameraFactory open_;
  LadderOptions ladder_;
  std::atomic<CameraLock> locked_{CameraLock::automatic};
  std::atomic<std::int64_t> left_out_{0};
  // Of the pump's thread.
  std::unique_ptr<CameraDevice> camera_;
  bool is_rewound_ = false;
  mutable std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::optional<CameraInfo> info_;
  std::deque<Frame> frames_;
  std::deque<std::function<void()>> tasks_;
  PumpNews news_;  // without a frame
  bool is_end_told_ = false;
  bool is_stopped_ = false;
  bool is_over_ = false;  // the thread does nothing more
  std::thread thread_;
};

}  // namespace gyre
