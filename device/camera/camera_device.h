// SPDX-License-Identifier: Apache-2.0
// What the session asks of any camera, real or replayed.
#pragma once

#include "common/result/result.h"
#include "common/video/frame_source.h"

#include <chrono>
#include <functional>
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

  // Delivers frames of the last recording once more, after it was stopped. indices: ascending. An error of `take` ends
  // it and is returned.
  virtual Result<void> recall(const std::vector<int>& indices,
                              const std::function<Result<void>(const Frame&)>& take) = 0;
};

// Opens a camera by its name: "replay:PATH". Errors: another kind of name (wrong use), a capture that cannot be opened.
enum class Pace { recorded, fast };
Result<std::unique_ptr<CameraDevice>> open_camera(const std::string& name, Pace pace);

}  // namespace gyre
