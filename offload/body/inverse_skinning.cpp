// SPDX-License-Identifier: Apache-2.0
#include "offload/body/inverse_skinning.h"

#include <Eigen/LU>

namespace gyre {

Eigen::Affine3d posed_from_rest_at(const BodyTemplate& body, const Eigen::Vector3i& corners,
                                   const Eigen::Vector3d& weights,
                                   const std::vector<Eigen::Affine3d>& posed_from_rest) {
  Eigen::Matrix<double, 3, 4> sum = Eigen::Matrix<double, 3, 4>::Zero();
  for (int c = 0; c < 3; ++c) {
    const SkinWeights& skin = body.skin[corners[c]];
    for (std::size_t k = 0; k < skin.joint.size(); ++k)
      if (skin.weight[k] != 0)
        sum += weights[c] * static_cast<double>(skin.weight[k]) * posed_from_rest[skin.joint[k]].matrix().topRows<3>();
  }
  Eigen::Affine3d transform = Eigen::Affine3d::Identity();
  transform.matrix().topRows<3>() = sum;
  return transform;
}

Eigen::Affine3d posed_from_rest_at(const BodyTemplate& body, int vertex,
                                   const std::vector<Eigen::Affine3d>& posed_from_rest) {
  return posed_from_rest_at(body, Eigen::Vector3i::Constant(vertex), Eigen::Vector3d::UnitX(), posed_from_rest);
}

Eigen::Vector3d rest_point(const Eigen::Affine3d& posed_from_rest, const Eigen::Vector3d& point) {
  return posed_from_rest.linear().inverse() * (point - posed_from_rest.translation());
}

Eigen::Vector3d rest_normal(const Eigen::Affine3d& posed_from_rest, const Eigen::Vector3d& normal) {
  return (posed_from_rest.linear().transpose() * normal).normalized();
}

Eigen::ParametrizedLine<double, 3> rest_ray(const Eigen::Affine3d& posed_from_rest,
                                            const Eigen::ParametrizedLine<double, 3>& ray) {
  return {rest_point(posed_from_rest, ray.origin()),
          (posed_from_rest.linear().inverse() * ray.direction()).normalized()};
}

}  // namespace gyre
