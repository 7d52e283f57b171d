// SPDX-License-Identifier: Apache-2.0
// A recorded capture in the place of a camera.
#pragma once

#include "device/camera/camera_device.h"

#include <filesystem>

namespace gyre {

// At the recorded pace a frame comes when its time since the start has passed, and as fast as it is asked for
// otherwise. None is ever dropped: a late consumer gets it late, so that a replay always gives the same scan.
// Errors: those of open_capture.
Result<std::unique_ptr<CameraDevice>> open_replay_camera(const std::filesystem::path& capture, Pace pace);

}  // namespace gyre
