// SPDX-License-Identifier: Apache-2.0
// Everything that is measured on a camera frame while the operator walks.
#pragma once

#include "common/geometry/camera.h"
#include "common/selection/measure.h"
#include "common/video/frame_source.h"
#include "device/analysis/camera_motion.h"
#include "device/analysis/focus.h"
#include "device/camera/camera_device.h"

#include <optional>

namespace gyre {

struct FrameReading {
  int index = 0;
  double time = 0.0;
  FrameMeasure measure;         // what selection decides on
  double motion = 0.0;          // mean flow, picture widths a second
  double blur_px = 0.0;         // that flow makes while the shutter is open, pixels of the full picture
  bool exposure_known = false;  // else the shutter is taken to be open half of the time between frames
  double brightness = 0.0;      // mean luma, 0 to 1
  double underexposed = 0.0;    // share of pixels in the deepest sixteenth of the levels
  double overexposed = 0.0;     // share of pixels within five levels of white
  FocusReading focus;
  CameraMotion camera;
};

// The lens of a camera: the one that was calibrated, when its pictures have the shape of the camera's; else from the
// focal length that EXIF tells, else a usual one (62 degrees along the longer side).
Camera lens_of(const CameraInfo& camera, const std::optional<Camera>& calibrated = {});

// Belongs to one thread.
class FrameAnalysis {
 public:
  explicit FrameAnalysis(const CameraInfo& camera, const std::optional<Camera>& calibrated = {},
                         const MeasureOptions& options = {})
      : meter_(options), motion_(lens_of(camera, calibrated)), fps_(camera.fps), width_(camera.width) {}

  // The next frame, with the time its shutter was open (seconds) when the camera says it.
  FrameReading add(const Frame& frame, std::optional<double> exposure_s = {});

  // Luma of the last frame, of the size flow is computed at.
  const cv::Mat& luma() const { return meter_.luma(); }

 private:
  FrameMeter meter_;
  CameraMotionEstimator motion_;
  FocusWatch focus_;
  double fps_;
  int width_;
  double last_time_ = 0.0;
};

}  // namespace gyre
