// SPDX-License-Identifier: Apache-2.0
#include "offload/avatar/avatar.h"
#include "tests/offload/avatar/small_template.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

TEST(Avatar, SplitsAtTextureSeamsAndKeepsTheShape) {
  const BodyTemplate body = small_template();
  const auto avatar = assemble_avatar(body, body.mesh.vertices, joint_positions(body, body.mesh.vertices));
  ASSERT_TRUE(avatar) << avatar.error().message();
  EXPECT_EQ(avatar->positions.size(), 24U);  // eight corners on three sides each
  ASSERT_EQ(avatar->triangles.size(), body.mesh.triangles.size());
  for (std::size_t t = 0; t < avatar->triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const int v = avatar->triangles[t][k];
      EXPECT_EQ(avatar->positions[v], body.mesh.vertices[body.mesh.triangles[t][k]].cast<float>());
      EXPECT_EQ(avatar->uv[v], body.mesh.uv[body.mesh.uv_triangles[t][k]].cast<float>());
      EXPECT_NEAR(avatar->normals[v].norm(), 1.0F, 1e-6F);
    }
  }
}

TEST(Avatar, ExpressionsGrowWithTheHead) {
  const BodyTemplate body = small_template();
  std::vector<Eigen::Vector3d> rest = body.mesh.vertices;
  for (Eigen::Vector3d& v : rest) v *= 1.25;
  const auto avatar = assemble_avatar(body, rest, joint_positions(body, rest));
  ASSERT_TRUE(avatar) << avatar.error().message();
  ASSERT_EQ(avatar->morphs.size(), 1U);
  for (std::size_t v = 0; v < avatar->positions.size(); ++v) {
    const Eigen::Vector3f& at = avatar->positions[v];
    const bool moved = at.y() > 0.5F && at.z() > 0;
    EXPECT_NEAR(avatar->morphs[0].positions[v].y(), moved ? -0.0125F : 0.0F, 1e-6F);
  }
}

TEST(Avatar, RefusesAShapeOfAnotherTemplate) {
  const BodyTemplate body = small_template();
  const std::vector<Eigen::Vector3d> joints = joint_positions(body, body.mesh.vertices);
  EXPECT_FALSE(assemble_avatar(body, {Eigen::Vector3d::Zero()}, joints));
  EXPECT_FALSE(assemble_avatar(body, body.mesh.vertices, {}));
}

TEST(Avatar, RefusesMoreJointsThanImportersTake) {
  BodyTemplate body = small_template();
  while (body.joints.size() < 128) body.joints.push_back({"tail" + std::to_string(body.joints.size()), 0, {}, {}});
  const std::vector<Eigen::Vector3d> joints(body.joints.size(), Eigen::Vector3d::Zero());
  const auto avatar = assemble_avatar(body, body.mesh.vertices, joints);
  ASSERT_FALSE(avatar);
  EXPECT_NE(avatar.error().message().find("128"), std::string::npos);
}

TEST(TidyWeights, MergesDropsSortsAndNormalises) {
  SkinWeights weights;
  weights.joint = {7, 3, 7, 9};
  weights.weight = {0.2F, 0.5F, 0.2F, 0.00001F};
  const SkinWeights tidy = tidy_weights(weights);
  EXPECT_EQ(tidy.joint, (std::array<int, 4>{3, 7, 0, 0}));
  EXPECT_NEAR(tidy.weight[0], 0.5F / 0.9F, 1e-6F);
  EXPECT_NEAR(tidy.weight[0] + tidy.weight[1], 1.0F, 1e-6F);
  EXPECT_EQ(tidy.weight[2], 0.0F);
}

TEST(TidyWeights, GivesAnUnweightedVertexToTheRoot) {
  const SkinWeights tidy = tidy_weights(SkinWeights{});
  EXPECT_EQ(tidy.joint[0], 0);
  EXPECT_EQ(tidy.weight[0], 1.0F);
}

}  // namespace
}  // namespace gyre
