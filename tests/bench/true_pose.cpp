// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/true_pose.h"

#include <nlohmann/json.hpp>
#include <numbers>

namespace gyre::bench {

Pose true_pose(const nlohmann::json& frame) {
  Eigen::Matrix4d m;
  for (int i = 0; i < 16; ++i) m(i / 4, i % 4) = frame.at("cam_from_world").at(i / 4).at(i % 4).get<double>();
  const double yaw = frame.at("subject_yaw_deg").get<double>() * std::numbers::pi / 180.0;
  const Eigen::Quaterniond rotation(Eigen::Matrix3d(m.topLeftCorner<3, 3>()));
  return {(rotation * Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY())).normalized(), m.topRightCorner<3, 1>()};
}

}  // namespace gyre::bench
