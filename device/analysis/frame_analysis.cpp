// SPDX-License-Identifier: Apache-2.0
#include "device/analysis/frame_analysis.h"

#include <algorithm>
#include <opencv2/core.hpp>

namespace gyre {

namespace {

double share_of(const cv::Mat& mask) {
  return static_cast<double>(cv::countNonZero(mask)) / static_cast<double>(mask.total());
}

}  // namespace

Camera lens_of(const CameraInfo& camera, const std::optional<Camera>& calibrated) {
  constexpr double same_shape = 0.01;
  if (calibrated && calibrated->width > 0) {
    const double factor = static_cast<double>(camera.width) / calibrated->width;
    if (std::abs(factor * calibrated->height - camera.height) <= same_shape * camera.height)
      return calibrated->scaled(factor);
  }
  constexpr double usual_fov = 62.0 * M_PI / 180.0;
  if (!camera.focal_35mm) return Camera::from_fov(camera.width, camera.height, usual_fov);
  constexpr double film_width = 36.0;
  return Camera::from_fov(camera.width, camera.height, 2.0 * std::atan(0.5 * film_width / *camera.focal_35mm));
}

FrameReading FrameAnalysis::add(const Frame& frame, std::optional<double> exposure_s) {
  constexpr double deepest = 16.0;
  constexpr double white = 250.0;
  constexpr double usual_shutter = 0.5;
  FrameReading reading;
  reading.index = frame.index;
  reading.time = frame.time;
  reading.measure = meter_.measure(frame.image);
  const cv::Mat& luma = meter_.luma();
  const double passed = frame.time - last_time_;
  const double interval = passed > 0.0 ? passed : fps_ > 0.0 ? 1.0 / fps_ : 1.0;
  const double enlarged = static_cast<double>(width_) / luma.cols;  // the picture may be larger than the image
  reading.camera = motion_.add(luma, frame.time);
  reading.motion = reading.measure.motion / interval / luma.cols;
  reading.exposure_known = exposure_s.has_value();
  reading.blur_px = reading.measure.motion * enlarged * exposure_s.value_or(usual_shutter * interval) / interval;
  reading.brightness = cv::mean(luma)[0] / 255.0;
  reading.underexposed = share_of(luma < deepest);
  reading.overexposed = share_of(luma >= white);
  reading.focus = focus_.add(frame.time, reading.measure.sharpness, reading.motion);
  last_time_ = frame.time;
  return reading;
}

}  // namespace gyre
