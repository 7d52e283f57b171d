// SPDX-License-Identifier: Apache-2.0
#include "offload/body/joint_anatomy.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gyre {

Eigen::Vector3d hip_centre(const Eigen::Vector3d& rigged, std::span<const Eigen::Vector3f> body) {
  constexpr double band = 0.015;                  // metres above and below
  constexpr double widest = 2.2;                  // of the rig's distance from the middle: farther out are hands
  constexpr double apart = 0.5, in_front = 0.58;  // shares of half the breadth and of the depth
  double back = std::numeric_limits<double>::infinity(), front = -back, half_breadth = 0.0;
  for (const Eigen::Vector3f& v : body) {
    const Eigen::Vector3d p = v.cast<double>();
    if (std::abs(p.y() - rigged.y()) > band || std::abs(p.x()) > widest * std::abs(rigged.x())) continue;
    back = std::min(back, p.z());
    front = std::max(front, p.z());
    half_breadth = std::max(half_breadth, std::abs(p.x()));
  }
  if (!(front > back)) return rigged;
  return {std::copysign(apart * half_breadth, rigged.x()), rigged.y(), back + in_front * (front - back)};
}

Eigen::Vector3d pelvis_centre(const Eigen::Vector3d& left_hip, const Eigen::Vector3d& right_hip,
                              const Eigen::Vector3d& lumbosacral) {
  return 0.25 * (left_hip + right_hip) + 0.5 * lumbosacral;
}

}  // namespace gyre
