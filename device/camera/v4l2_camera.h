// SPDX-License-Identifier: Apache-2.0
// A USB camera (or any other video device of Linux).
#pragma once

#include "device/camera/camera_device.h"
#include "device/camera/camera_name.h"

#include <string>

namespace gyre {

// Opens the device of the name. Of MJPEG a frame's `jpeg` is the bytes of the camera and its image is decoded reduced;
// of NV12 and YUYV the picture is compressed when it is asked for. Frames that the kernel or the decoder calls damaged
// are counted and left out. A failing stream is an error of next(), and stop() and start() may help.
// identity: empty, or what an earlier call left there: then the device is the one with that identity, wherever it is
// now. Errors: no device, no camera, no format of the three, another camera in its place.
Result<std::unique_ptr<CameraDevice>> open_v4l2_camera(const CameraName& name, std::string& identity);

}  // namespace gyre
