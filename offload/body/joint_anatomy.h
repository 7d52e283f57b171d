// SPDX-License-Identifier: Apache-2.0
// Where anatomy has the joints of the pelvis, which the rig of the base mesh places for a handsome deformation.
#pragma once

#include <Eigen/Core>
#include <span>

namespace gyre {

// Centre of the femoral head of one side, from where the rig has it and the skin around it. Its height is kept: the
// rig's is that of the greater trochanter (0.52 of the stature, ANSUR II), which the femoral head is level with. The
// two centres lie half the breadth of the hips apart (Harrington et al., J. Biomech. 40, 2007: 0.33 pelvic widths + 7
// mm from the middle, which gives 172 mm for hips of 345 mm), and 0.58 of the depth of the buttocks in front of their
// back (0.24 pelvic depths + 10 mm behind the iliac spines, with the pelvis tilted as in standing). body: skin
// vertices, metres, +Y up, facing +Z, arms off the hips; where they have nothing at that height, the rig's joint is
// kept.
Eigen::Vector3d hip_centre(const Eigen::Vector3d& rigged, std::span<const Eigen::Vector3f> body);

// Centre of the pelvis: midway between the hip centres and the lumbosacral joint.
Eigen::Vector3d pelvis_centre(const Eigen::Vector3d& left_hip, const Eigen::Vector3d& right_hip,
                              const Eigen::Vector3d& lumbosacral);

}  // namespace gyre
