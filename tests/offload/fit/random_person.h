// SPDX-License-Identifier: Apache-2.0
// Somebody the template can be, in A-pose, and the flawed cloud a capture of them would give.
#pragma once

#include "offload/body/body_state.h"
#include "tests/offload/fit/sample_cloud.h"

#include <cstdint>
#include <vector>

namespace gyre {

struct RandomPerson {
  double yaw = 0.0;  // radians
  BodyState state;
  PosedBody posed;
};

// Shapes and heads up to two standard deviations, any heading, arms 28 to 52 degrees off the body, elbows bent up to 20
// degrees, small turns of trunk, neck, hands and legs.
RandomPerson random_person(const BodyTemplate& body, std::uint64_t seed);

struct FlawOptions {
  double arm_holes = 0.15;  // share of the arms' points lost, in patches of 4 cm
  double outliers = 0.01;   // share of all points that lie anywhere around the person
  std::uint64_t seed = 1;
};

// Loses and adds points.
PointCloud with_flaws(const PointCloud& cloud, const RandomPerson& person, const BodyTemplate& body,
                      const FlawOptions& options = {});

// The points for which `keep` holds, without colours and views.
template <class F>
PointCloud only(const PointCloud& cloud, const F& keep) {
  PointCloud kept;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    if (!keep(Eigen::Vector3d(cloud.points[i].cast<double>()))) continue;
    kept.points.push_back(cloud.points[i]);
    kept.normals.push_back(cloud.normals[i]);
    if (!cloud.confidence.empty()) kept.confidence.push_back(cloud.confidence[i]);
    if (!cloud.deviation.empty()) kept.deviation.push_back(cloud.deviation[i]);
  }
  return kept;
}

// How far a fitted surface and its joints are from the truth, metres.
struct ClosedLoopErrors {
  std::vector<double> true_to_fitted, fitted_to_true, joints;  // of surfaces cameras see; of the main joints
  double facing = 0.0;                                         // radians, absolute
  bool sides_swapped = false;                                  // a hand is nearer to the true other one
};
ClosedLoopErrors closed_loop_errors(const BodyTemplate& body, const RandomPerson& person,
                                    const std::vector<Eigen::Vector3d>& vertices,
                                    const std::vector<Eigen::Vector3d>& joints, double yaw);

// Hips, neck, head and those of the limbs, by name.
const std::vector<std::string>& main_joint_names();

}  // namespace gyre
