// SPDX-License-Identifier: Apache-2.0
// People whose landmarks are known, as clouds.
#pragma once

#include "common/mesh/mesh.h"
#include "offload/landmarks/detector.h"

#include <cstdint>
#include <functional>
#include <map>
#include <string>

namespace gyre {

struct PersonOptions {
  double stature = 1.70;  // metres
  double yaw = 0.0;       // radians
  double noise = 0.002;   // metres
  int points = 60000;
  std::uint64_t seed = 1;
  std::function<bool(const Eigen::Vector3d&)> hole;  // true where the cloud has none, in the person's own axes
};

struct Person {
  PointCloud cloud;
  std::map<std::string, Eigen::Vector3d> joints;  // as the synthetic subject names them, in the world
  double yaw = 0.0;
};

// The synthetic subject in A-pose at the origin of the world.
Person synthetic_person(const PersonOptions& options);

// Cameras around a person of that stature, at chest height, without pictures.
std::vector<LandmarkView> views_around(double stature, int count);

}  // namespace gyre
