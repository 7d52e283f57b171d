// SPDX-License-Identifier: Apache-2.0
#include "offload/avatar/rebind.h"

namespace gyre {

namespace {

Eigen::Affine3d blended(const SkinWeights& skin, const std::vector<Eigen::Affine3d>& posed_from_rest) {
  Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
  for (int k = 0; k < 4; ++k)
    if (skin.weight[k] > 0) sum += skin.weight[k] * posed_from_rest[skin.joint[k]].matrix();
  return Eigen::Affine3d(sum);
}

}  // namespace

Avatar rebound(const Avatar& avatar, const std::vector<Eigen::Affine3d>& posed_from_rest) {
  Avatar posed = avatar;
  for (std::size_t v = 0; v < avatar.positions.size(); ++v) {
    const Eigen::Affine3d motion = blended(avatar.skin[v], posed_from_rest);
    // Normals turn by the cofactors, which stay finite where a blend flattens.
    const Eigen::Matrix3d linear = motion.linear();
    Eigen::Matrix3d cofactors;
    cofactors << linear.col(1).cross(linear.col(2)), linear.col(2).cross(linear.col(0)),
        linear.col(0).cross(linear.col(1));
    const auto turned = [&](const Eigen::Vector3f& normal) -> Eigen::Vector3d {
      return (cofactors * normal.cast<double>()).normalized();
    };
    posed.positions[v] = (motion * avatar.positions[v].cast<double>()).cast<float>();
    const Eigen::Vector3d normal = turned(avatar.normals[v]);
    posed.normals[v] = normal.cast<float>();
    for (std::size_t m = 0; m < avatar.morphs.size(); ++m) {
      const Eigen::Vector3f& offset = avatar.morphs[m].positions[v];
      if (!offset.isZero(0)) posed.morphs[m].positions[v] = (linear * offset.cast<double>()).cast<float>();
      const Eigen::Vector3f& change = avatar.morphs[m].normals[v];
      if (!change.isZero(0)) posed.morphs[m].normals[v] = (turned(avatar.normals[v] + change) - normal).cast<float>();
    }
  }
  for (std::size_t j = 0; j < avatar.joints.size(); ++j)
    posed.joints[j].position = posed_from_rest[j] * avatar.joints[j].position;
  return posed;
}

}  // namespace gyre
