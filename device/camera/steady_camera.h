// SPDX-License-Identifier: Apache-2.0
// A live camera that is brought back when it fails, without the scan in progress noticing more than a pause.
#pragma once

#include "device/camera/camera_clock.h"
#include "device/camera/camera_device.h"
#include "device/camera/fault_ladder.h"

#include <functional>
#include <memory>

namespace gyre {

struct SteadyOptions {
  LadderOptions ladder;

  Result<void> check() const;
};

// Opens the device, as often as need be.
using CameraFactory = std::function<Result<std::unique_ptr<CameraDevice>>()>;

// Climbs the ladder of fault_ladder.h. Over restarts and reopenings frames go on to be numbered without holes, their
// times go on with the time that passed, and what was locked is locked again. While the
// camera is away next() gives timeouts that say `recovering`; the error at the end of the ladder is for the service
// manager. A camera that comes back with frames of another size has not come back. Errors: those of the first opening,
// options out of range.
Result<std::unique_ptr<CameraDevice>> open_steady_camera(CameraFactory open, std::shared_ptr<CameraClock> clock,
                                                         const SteadyOptions& options = {});

}  // namespace gyre
