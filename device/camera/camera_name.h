// SPDX-License-Identifier: Apache-2.0
// Names of cameras, as the operator writes them:
//
//   replay:PATH                     a video or a folder of pictures
//   v4l2:/dev/video0                a USB camera, better by its name in /dev/v4l/by-id
//   libcamera:  libcamera:ID        the first camera of libcamera, or the one with that id
//
// with settings behind a question mark: replay:PATH?faults=FILE, v4l2:DEVICE?size=1280x720&format=MJPG&buffers=4.
#pragma once

#include "common/result/result.h"

#include <string>
#include <string_view>

namespace gyre {

struct CameraName {
  enum class Kind { replay, v4l2, libcamera };
  Kind kind = Kind::replay;
  std::string target;  // path or id; may be empty for libcamera
  std::string faults;  // replay: file of fault_script.h; empty: none
  int width = 0;       // live: of the pictures wanted, the nearest there is is taken; 0: as large as is fast enough
  int height = 0;
  std::string format;  // v4l2: MJPG, NV12 or YUYV; empty: the first of these that there is
  int buffers = 4;     // live: that the camera fills in turn, 1 to 8
};

// A question mark that no settings follow belongs to the target. Errors (wrong use): another kind of name, nothing
// where a target must be, a setting that this kind does not have or with an impossible value.
Result<CameraName> parse_camera_name(std::string_view text);

// The text that reads as this name; settings at their defaults are left out.
std::string to_string(const CameraName& name);

}  // namespace gyre
