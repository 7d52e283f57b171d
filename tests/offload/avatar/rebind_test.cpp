// SPDX-License-Identifier: Apache-2.0
#include "offload/avatar/rebind.h"

#include "tests/offload/avatar/small_template.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

Avatar box() {
  const BodyTemplate body = small_template();
  return *assemble_avatar(body, body.mesh.vertices, joint_positions(body, body.mesh.vertices));
}

TEST(Rebound, ByNothingIsTheSame) {
  const Avatar avatar = box(), same = rebound(avatar, {Eigen::Affine3d::Identity(), Eigen::Affine3d::Identity()});
  for (std::size_t v = 0; v < avatar.positions.size(); ++v) {
    EXPECT_EQ(same.positions[v], avatar.positions[v]);
    EXPECT_LT((same.normals[v] - avatar.normals[v]).norm(), 1e-6F);
    EXPECT_EQ(same.morphs[0].positions[v], avatar.morphs[0].positions[v]);
  }
}

TEST(Rebound, TurnsSkinNormalsAndExpressionsWithTheirJoint) {
  const Avatar avatar = box();
  const Eigen::Affine3d turn(Eigen::Translation3d(0.1, 0.2, 0.3) * Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitX()));
  const Avatar turned = rebound(avatar, {Eigen::Affine3d::Identity(), turn});
  for (std::size_t v = 0; v < avatar.positions.size(); ++v) {
    const bool upper = avatar.skin[v].joint[0] == 1;
    const Eigen::Affine3d motion = upper ? turn : Eigen::Affine3d::Identity();
    EXPECT_LT((turned.positions[v].cast<double>() - motion * avatar.positions[v].cast<double>()).norm(), 1e-6);
    EXPECT_LT((turned.normals[v].cast<double>() - motion.linear() * avatar.normals[v].cast<double>()).norm(), 1e-6);
    // The smile of a turned head is the turned smile.
    const Eigen::Vector3d smiling = motion * (avatar.positions[v] + avatar.morphs[0].positions[v]).cast<double>();
    EXPECT_LT((turned.positions[v] + turned.morphs[0].positions[v] - smiling.cast<float>()).norm(), 1e-6F);
  }
  EXPECT_LT((turned.joints[1].position - turn * avatar.joints[1].position).norm(), 1e-12);
  // Back again.
  const Avatar back = rebound(turned, {Eigen::Affine3d::Identity(), turn.inverse()});
  for (std::size_t v = 0; v < avatar.positions.size(); ++v)
    EXPECT_LT((back.positions[v] - avatar.positions[v]).norm(), 1e-6F);
}

}  // namespace
}  // namespace gyre
