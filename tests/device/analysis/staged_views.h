// SPDX-License-Identifier: Apache-2.0
// Exact views of points of a person and of the room behind, without pictures.
#pragma once

#include "common/geometry/camera.h"
#include "device/analysis/view_map.h"

#include <cmath>
#include <map>
#include <random>

namespace gyre::test {

struct StagedViews {
  static constexpr int subject = 40, room = 60;  // points; those of the subject have the first numbers
  static constexpr double depth = 2.0;           // of the subject from the first camera

  Camera camera = Camera::from_fov(180, 320, 58.0 * M_PI / 180.0);
  std::map<int, Eigen::Vector3d> places;

  StagedViews() {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    for (int i = 0; i < subject; ++i) places[i] = {0.2 * uniform(random), 0.6 * uniform(random), depth};
    for (int i = 0; i < room; ++i) {
      places[subject + i] =
          Eigen::Vector3d(0.25 * uniform(random), 0.45 * uniform(random), 1.0) * (4.5 + uniform(random));
    }
  }

  // The subject has stepped aside, to its left.
  View see(const Pose& cam_from_first, double time = 0.0, double aside = 0.0) const {
    View view{cam_from_first, {}, time, 0.0};
    for (const auto& [id, place] : places) {
      const Eigen::Vector3d now = place + Eigen::Vector3d(id < subject ? aside : 0.0, 0.0, 0.0);
      view.seen[id] = (cam_from_first * now).hnormalized();
    }
    return view;
  }

  // After a turn about the subject, radians.
  static Pose around(double turned) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(turned, Eigen::Vector3d::UnitY()));
    return {turn, Eigen::Vector3d(0, 0, depth) - turn * Eigen::Vector3d(0, 0, depth)};
  }

  // Of three views, with all places.
  ViewMap map() const {
    ViewMap map(camera);
    for (const double turned : {0.0, 0.05, 0.1}) map.add(see(around(turned)));
    map.place_new_points();
    return map;
  }
};

}  // namespace gyre::test
