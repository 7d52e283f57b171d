// SPDX-License-Identifier: Apache-2.0
// People who exist nowhere: a template in random shapes, with smooth offsets that no shape component has.
#pragma once

#include "offload/body/template.h"

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace gyre {

// The whole template in the rest pose: normal shape coefficients within two standard deviations, and waves of some 15
// cm over the body with `amplitude` metres deviation, after which the inner parts are carried along and the face
// settled.
std::vector<Eigen::Vector3d> random_person(const BodyTemplate& body, std::uint64_t seed, double amplitude = 0.003);

}  // namespace gyre
