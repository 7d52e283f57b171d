// SPDX-License-Identifier: Apache-2.0
// The macro parameters of MakeHuman's human and how they blend its targets.
#pragma once

#include "offload/body/makehuman.h"

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace gyre {

// All in [0, 1]; 0.5 is average. gender: 0 female, 1 male. age: 0.1875 is 10 years, 0.5 is 25, 1 is 90.
struct MacroShape {
  double gender = 0.5, age = 0.5, muscle = 0.5, weight = 0.5, height = 0.5, proportions = 0.5, cup = 0.5,
         firmness = 0.5;
  std::array<double, 3> ancestry = {1.0 / 3, 1.0 / 3, 1.0 / 3};  // african, asian, caucasian; sums to 1
};

// MakeHuman's age value for an age in years, 10 to 90.
double macro_age(double years);

// Target names and weights that make up a shape: products of the piecewise linear weights of each parameter, over the
// combinations that meta/macro.json of the sources lists.
std::vector<std::pair<std::string, double>> macro_targets(const MacroShape& shape);

// Adds weight * target to base vertices; a target that is not there adds nothing (averages have none).
void add_target(const TargetSet& targets, const std::string& name, double weight,
                std::vector<Eigen::Vector3d>& vertices);

}  // namespace gyre
