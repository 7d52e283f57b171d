// SPDX-License-Identifier: Apache-2.0
// How far estimated cameras are from the true ones.
#pragma once

#include "common/bundle/bundle.h"
#include "common/geometry/colmap_model.h"
#include "common/geometry/pose.h"
#include "common/result/result.h"
#include "offload/report/truth.h"

#include <vector>

namespace gyre {

struct CameraErrors {
  Similarity truth_from_model;            // least squares over the camera centres
  std::vector<double> centre;             // metres, one a registered keyframe that the truth knows
  std::vector<double> rotation;           // radians
  std::vector<double> true_scale_centre;  // metres, with the model's own scale kept: what a wrong scale costs
};

// Aligns the model's camera centres with the true ones (Umeyama, see align_points) and compares pose by pose. Error
// when fewer than three keyframes are registered.
Result<CameraErrors> camera_errors(const ColmapModel& model, const Truth& truth);

}  // namespace gyre
