// SPDX-License-Identifier: Apache-2.0
// Eyes, teeth, tongue and lashes follow the body around them.
#pragma once

#include "offload/body/template.h"

#include <Eigen/Core>
#include <vector>

namespace gyre {

// Moves every part but the body by the similarity that its surroundings went through from `before` to `after`: the
// `neighbours` body vertices nearest to the part. Both arrays hold the whole template; in `after` the body is final.
// Parts whose surroundings say nothing (fewer than three vertices, or a size change beyond a half) keep their size and
// take the mean shift.
void carry_inner_parts(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& before,
                       std::vector<Eigen::Vector3d>& after, int neighbours = 80);

}  // namespace gyre
