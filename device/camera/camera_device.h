// SPDX-License-Identifier: Apache-2.0
// What the session asks of any camera, real or replayed.
#pragma once

#include "common/result/result.h"
#include "common/video/frame_source.h"

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace gyre {

struct CameraInfo {
  std::string name;
  int width = 0;  // of the upright frames, pixels
  int height = 0;
  double fps = 0.0;                  // 0: single photographs
  int expected_frames = 0;           // of a recording that will end by itself; 0: goes on until it is stopped
  bool photographs = false;          // every frame was chosen by a person
  bool live = false;                 // there is no recording, see recall(): what is not kept is gone
  std::optional<double> focal_35mm;  // see ScanPass
};

struct CameraEvent {
  enum class Kind {
    frame,    // `frame` is set
    timeout,  // nothing came within the time given
    ended,    // nothing will come any more
  };
  Kind kind = Kind::timeout;
  std::optional<Frame> frame;
  bool recovering = false;  // of a timeout: the camera does not work and is being brought back
};

// Exposure, gain, white balance and focus: left to the camera, about to be held, held.
enum class CameraLock { automatic, settling, held };

// What happened since the camera was opened.
struct CameraCounters {
  std::int64_t queued = 0;     // buffers handed to the camera
  std::int64_t completed = 0;  // that came back with a picture, good or not
  std::int64_t cancelled = 0;  // that came back without one when the stream was stopped or broke
  std::int64_t torn = 0;       // pictures that were damaged and left out
  std::int64_t missed = 0;     // pictures that the camera took and nobody was there to get
  std::int64_t stray = 0;      // that came back without having been there; never, unless a driver is broken
  int restarts = 0;            // of the stream, to bring the camera back
  int reopenings = 0;          // of the device, likewise
};

// Used from one thread.
class CameraDevice {
 public:
  CameraDevice() = default;
  CameraDevice(const CameraDevice&) = delete;
  CameraDevice& operator=(const CameraDevice&) = delete;
  virtual ~CameraDevice() = default;

  virtual const CameraInfo& info() const = 0;

  // Frames are numbered from 0 at every start. Starting a started camera and stopping a stopped one do nothing.
  virtual Result<void> start() = 0;
  virtual void stop() = 0;

  // The next frame of a started camera, in order; waits at most `timeout`.
  virtual Result<CameraEvent> next(std::chrono::milliseconds timeout) = 0;

  // Lets exposure, gain, white balance and focus settle and then holds them, at the latest after `patience` of further
  // frames. They stay held over stop() and start(), until unlock(). Cameras that cannot be set count as held.
  virtual void lock(std::chrono::milliseconds) {}
  virtual void unlock() {}
  virtual CameraLock locked() const { return CameraLock::held; }

  // What to add to the camera's time stamps to get CLOCK_MONOTONIC, seconds; nothing before the first frame, and of
  // cameras without a clock.
  virtual std::optional<double> clock_offset() const { return std::nullopt; }

  // CLOCK_MONOTONIC at the moment that is 0 in the frames' times since the last start, seconds; nothing before the
  // first frame, and of cameras without a clock.
  virtual std::optional<double> time_zero() const { return std::nullopt; }

  virtual CameraCounters counters() const { return {}; }

  // Delivers frames of the last recording once more, after it was stopped. indices: ascending. An error of `take` ends
  // it and is returned. A camera has no recording unless it says so.
  virtual Result<void> recall(const std::vector<int>& indices,
                              const std::function<Result<void>(const Frame&)>& /*take*/) {
    if (indices.empty()) return {};
    return fail("a live camera has no recording", info().name);
  }
};

// Opens a camera by its name, see camera_name.h. Recordings are played at their pace or as fast as frames are asked
// for. Live cameras, and recordings that play one with faults, are brought back when they fail, see steady_camera.h.
// Errors: no such name (wrong use), a capture or device that cannot be opened.
enum class Pace { recorded, fast };
Result<std::unique_ptr<CameraDevice>> open_camera(const std::string& name, Pace pace);

}  // namespace gyre
