// SPDX-License-Identifier: Apache-2.0
// How far the joints of a person turn.
#pragma once

#include "offload/body/template.h"

#include <Eigen/Core>
#include <string_view>

namespace gyre {

// Ranges of grown people for the humanoid bones of `body`, measured from its rest pose: an elbow or knee that is bent
// at rest bends so much less. Axes: along the bone (to its first child), bending it forwards (fingers: into the palm),
// and sideways. Joints that are no humanoid bones turn freely. Sets Joint::range of all joints.
void set_joint_ranges(BodyTemplate& body);

// What a rotation vector has beyond its range along the range's axes, radians; zero within.
Eigen::Vector3d beyond(const JointRange& range, const Eigen::Vector3d& rotation);

// The rotation vector with each component brought back to its bounds.
Eigen::Vector3d within(const JointRange& range, const Eigen::Vector3d& rotation);

}  // namespace gyre
