// SPDX-License-Identifier: Apache-2.0
// A keyframe with its camera, cut to what it shows of the subject.
#pragma once

#include "common/geometry/camera.h"
#include "common/geometry/pose.h"
#include "offload/texture/colour.h"

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <span>
#include <string>

namespace gyre {

struct Photo {
  std::string name;
  Camera camera;  // of `image`
  Pose cam_from_world;
  cv::Mat image;           // 8-bit BGR
  bool head_pass = false;  // taken to show the head
  ToneCurve tone;          // brings it to the common exposure
  cv::Mat shift;           // 32-bit, two channels: where the surface seen at a pixel is shown instead, minus the pixel,
  int shift_grid = 1;      // at every so many pixels, from (0.5, 0.5) on; empty: no shift
};

// Cuts the picture to the projections of `vertices` (metres, world) plus `margin` pixels; the camera's principal point
// moves along. A picture that shows none of them becomes 1 x 1.
void crop_to(Photo& photo, std::span<const Eigen::Vector3d> vertices, int margin);

// Where the picture shows what the camera alone puts at `pixel`.
Eigen::Vector2d shifted(const Photo& photo, const Eigen::Vector2d& pixel);

// Encoded BGR of what the camera puts at a pixel (first centre at (0.5, 0.5)), shifted, by Catmull-Rom interpolation,
// borders repeated; in the photo's own exposure.
Eigen::Vector3f sample_raw(const Photo& photo, const Eigen::Vector2d& pixel);

// The same in the common exposure.
inline Eigen::Vector3f sample(const Photo& photo, const Eigen::Vector2d& pixel) {
  return photo.tone.apply(sample_raw(photo, pixel));
}

}  // namespace gyre
