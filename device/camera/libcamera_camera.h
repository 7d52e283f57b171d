// SPDX-License-Identifier: Apache-2.0
// A camera of libcamera: those on the board's own connector, and others.
#pragma once

#include "device/camera/camera_device.h"
#include "device/camera/camera_name.h"

namespace gyre {

// Opens the camera with the id that is the name's target, or the first there is. Pictures come from a main stream and
// what is measured from a small second one of the same request, where the camera has two; else the main stream serves
// both. What libcamera changes in the configuration is logged. Errors: no such camera, used by another program, no
// picture format that can be read.
Result<std::unique_ptr<CameraDevice>> open_libcamera(const CameraName& name);

}  // namespace gyre
