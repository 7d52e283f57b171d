// SPDX-License-Identifier: Apache-2.0
// The lower edge of the jaw, from sections through it.
#pragma once

#include "offload/landmarks/face_frame.h"

#include <array>
#include <string>
#include <vector>

namespace gyre {

struct JawMark {
  std::string name;                                 // leftJaw, leftJawAngle, rightJaw, rightJawAngle
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  // metres, in the face's frame
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
};

// In vertical sections through the middle of the head, 24 degrees (Jaw) and 62 degrees (JawAngle) to either side of
// straight ahead, the jaw's edge is the point farthest along a direction between outward and down, where the section
// bends there as a jaw does. Where along the edge such a point lies is known least, and its covariance says so.
// Marks that are not found are left out. sides[0] holds the
// points that can be seen from the left, sides[1] from the right, in the world; stature in metres.
std::vector<JawMark> find_jaw(const FaceFrame& frame, const std::array<std::vector<Eigen::Vector3d>, 2>& sides,
                              double stature);

}  // namespace gyre
