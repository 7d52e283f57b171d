// SPDX-License-Identifier: Apache-2.0
// Orientations of all views at once from the relative rotations of pairs, before anything is triangulated.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <span>
#include <vector>

namespace gyre {

struct RelativeRotation {
  int a = 0;
  int b = 0;
  Eigen::Quaterniond b_from_a = Eigen::Quaterniond::Identity();
  double weight = 1.0;  // how much it is to be trusted; the tree begins with the most trusted ones
};

struct RotationAveragingOptions {
  int first_iterations = 20;  // with the sum of absolute errors, which forgives a false pair in the tree
  int iterations = 20;
  double width = 0.05;  // radians of disagreement beyond which a relative rotation loses its say
};

struct RotationAverage {
  std::vector<std::optional<Eigen::Quaterniond>> cam_from_world;  // per view; none outside the largest connected group
  std::vector<double> disagreement;  // per relative rotation, radians; infinity where a view has no rotation
};

// Rotations with cam_from_world[b] = b_from_a * cam_from_world[a] as nearly as all of them allow: from a spanning tree
// of the most trusted pairs, by iteratively reweighted least squares of absolute errors, then with Geman-McClure
// weights (Chatterjee and Govindu, "Robust relative rotation averaging", PAMI 2018, sections 4 and 5), so that the
// error of a ring is spread over all of it and does not pile up where it closes. The first view of the group keeps the
// rotation of the tree: identity at its root.
RotationAverage average_rotations(int views, std::span<const RelativeRotation> relative,
                                  const RotationAveragingOptions& options = {});

}  // namespace gyre
