// SPDX-License-Identifier: Apache-2.0
// Whether the lids lie outside of the eyeballs, asked of the eyeballs: independent of how contacts are found and
// mended.
#pragma once

#include "offload/body/template.h"

#include <Eigen/Core>
#include <vector>

namespace gyre {

// Furthest that a vertex of an eyeball stands out through skin, metres, along the ray from the eyeball's middle; 0 when
// none does. Only vertices that skin covers in template_state count: what a lid that opens further than the template's
// lays bare is no fault. Both states hold the whole template in the same deformation.
double eyeballs_through_lids(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& template_state,
                             const std::vector<Eigen::Vector3d>& state);

}  // namespace gyre
