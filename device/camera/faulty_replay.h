// SPDX-License-Identifier: Apache-2.0
// A recording that plays a live camera, with everything that goes wrong with one.
#pragma once

#include "device/camera/camera_clock.h"
#include "device/camera/camera_device.h"
#include "device/camera/fault_script.h"

#include <memory>
#include <vector>

namespace gyre {

// The plug of such a camera: what opens it again and again. The recording stands still while the camera does not work,
// and goes on when it was started or opened anew because of a fault; any other start begins it anew, with all its
// faults. Torn and missing frames are counted and left out, as those of a real camera are.
class FaultyReplay {
 public:
  // recording: not started, and as fast as it is asked. Frames come at their time by `clock`.
  FaultyReplay(std::unique_ptr<CameraDevice> recording, std::vector<Fault> faults, std::shared_ptr<CameraClock> clock);
  FaultyReplay(const FaultyReplay&) = delete;
  FaultyReplay& operator=(const FaultyReplay&) = delete;
  ~FaultyReplay();

  // The device, if it is there; what was opened before then no longer works.
  Result<std::unique_ptr<CameraDevice>> open();

 private:
  class Rig;
  class Handle;
  std::shared_ptr<Rig> rig_;
};

}  // namespace gyre
