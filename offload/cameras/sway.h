// SPDX-License-Identifier: Apache-2.0
// How the subject stood in each picture, against the room: a second opinion on motion.
#pragma once

#include "offload/cameras/scene.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

namespace gyre {

// Of one registered view.
struct ViewSway {
  int view = 0;
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();  // of the subject from its mean place, world, metres
  double deviation =
      0;  // standard deviation of a component of it, by noise of the keypoints of subject and room, metres
  double subject_error = 0;     // rms residual of the subject's features were it still in the room, pixels
  double background_error = 0;  // rms residual of the room's features, pixels
  int subject_count = 0;        // features behind each
  int background_count = 0;
};

// The scene is registered, triangulated and in the world's frame (metres, +Y up); `subject` encloses the subject.
// Tracks inside the upright cylinder in that box are the subject's, those outside the box the room's. Cameras that have
// seen both were drawn along with the subject, so they are first adjusted to the room alone (with the lens as it is).
// Then the subject's points X_i and one shift s_v a view are found together, which minimise
//   sum rho(|project(P_v, X_i + s_v) - x_iv|^2) + sum |s_v|^2 / 10 mm^2
// by Gauss-Newton with the points eliminated (Schur complement; Triggs et al., "Bundle adjustment - a modern
// synthesis", 1999, section 6.1), rho Cauchy's. The prior takes away what cannot be seen: a shift common to all views,
// a subject that grows while it moves away from every camera. Views with fewer than 20 features of the subject or of
// the room, or whose shift is not determined, are left out; so is everything when the room has too little texture. Runs
// on one thread.
std::vector<ViewSway> estimate_sway(const Scene& scene, const Eigen::AlignedBox3d& subject);

// Median length of the shifts, metres; 0 without any.
double median_sway(std::span<const ViewSway> sway);

// sway.json: an array, one object a view that has a result: name (names[view]), sway_mm [x, y, z], std_mm, subject_px,
// background_px, subject_features, background_features.
nlohmann::json to_json(std::span<const ViewSway> sway, std::span<const std::string> names);

}  // namespace gyre
