// SPDX-License-Identifier: Apache-2.0
#include "offload/body/t_pose.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

class TPose : public testing::Test {
 protected:
  static const BodyTemplate& human() {
    static const BodyTemplate body = built_in_template();
    return body;
  }

  const BodyTemplate& body_ = human();
  std::vector<Eigen::Vector3d> rest_ = shaped_vertices(body_, Eigen::VectorXd::Constant(3, 0.8));
  std::vector<Eigen::Vector3d> joints_ = joint_positions(body_, rest_);
  BodyPose pose_ = t_pose(body_, joints_);
  ReposedSurface t_ = repose(body_, rest_, joints_, pose_);

  Eigen::Vector3d joint(const std::string& name) const { return t_.joints[body_.joint_index(name)]; }
  Eigen::Vector3d bone(const std::string& from, const std::string& to) const {
    return (joint(to) - joint(from)).normalized();
  }
};

TEST_F(TPose, ArmsPointAlongX) {
  for (const auto& [side, sign] : {std::pair<std::string, double>("left", 1.0), {"right", -1.0}}) {
    const Eigen::Vector3d along = sign * Eigen::Vector3d::UnitX();
    EXPECT_LT((bone(side + "UpperArm", side + "LowerArm") - along).norm(), 1e-9);
    EXPECT_LT((bone(side + "LowerArm", side + "Hand") - along).norm(), 1e-9);
    EXPECT_LT((bone(side + "Hand", side + "MiddleProximal") - along).norm(), 1e-9);
  }
}

TEST_F(TPose, PalmsLookDownAndThumbsForward) {
  for (const auto& [side, sign] : {std::pair<std::string, double>("left", 1.0), {"right", -1.0}}) {
    const Eigen::Vector3d back =
        sign * bone(side + "Hand", side + "IndexProximal").cross(bone(side + "Hand", side + "LittleProximal"));
    // Knuckles lie on an arch, so their plane may lean along the fingers but not across them.
    EXPECT_NEAR(back.z() / back.norm(), 0.0, 1e-9) << side;
    EXPECT_GT(back.y() / back.norm(), 0.99) << side;
    EXPECT_GT(joint(side + "IndexProximal").z(), joint(side + "LittleProximal").z());
    EXPECT_GT(joint(side + "ThumbDistal").z(), joint(side + "MiddleProximal").z());
  }
}

TEST_F(TPose, FingersAreStraightAndThumbsAtHalfARightAngle) {
  for (const auto& [side, sign] : {std::pair<std::string, double>("left", 1.0), {"right", -1.0}}) {
    const Eigen::Vector3d along = sign * Eigen::Vector3d::UnitX();
    for (const std::string finger : {"Index", "Middle", "Ring", "Little"}) {
      EXPECT_LT((bone(side + finger + "Proximal", side + finger + "Intermediate") - along).norm(), 1e-9);
      EXPECT_LT((bone(side + finger + "Intermediate", side + finger + "Distal") - along).norm(), 1e-9);
    }
    const Eigen::Vector3d out = (along + Eigen::Vector3d::UnitZ()).normalized();
    EXPECT_LT((bone(side + "ThumbMetacarpal", side + "ThumbProximal") - out).norm(), 1e-9);
    EXPECT_LT((bone(side + "ThumbProximal", side + "ThumbDistal") - out).norm(), 1e-9);
  }
}

TEST_F(TPose, LegsAreStraightAndSolesStandOnTheFloor) {
  for (const std::string side : {"left", "right"}) {
    EXPECT_LT((bone(side + "UpperLeg", side + "LowerLeg") + Eigen::Vector3d::UnitY()).norm(), 1e-9);
    EXPECT_LT((bone(side + "LowerLeg", side + "Foot") + Eigen::Vector3d::UnitY()).norm(), 1e-9);
  }
  double lowest = 1.0;
  for (int v = 0; v < body_.parts[0].vertex_count; ++v) lowest = std::min(lowest, t_.vertices[v].y());
  EXPECT_NEAR(lowest, 0.0, 1e-12);
  EXPECT_LT(t_.joints[body_.joint_index("leftFoot")].y(), 0.15);
}

TEST_F(TPose, GoesBackToTheRestPose) {
  const auto back = unskin_vertices(body_, t_.vertices, t_.reposed_from_rest);
  for (std::size_t v = 0; v < back.size(); ++v) ASSERT_LT((back[v] - rest_[v]).norm(), 1e-9);
}

TEST_F(TPose, KeepsBoneLengthsAndIsItsOwnTPose) {
  for (std::size_t j = 1; j < joints_.size(); ++j) {
    const int parent = body_.joints[j].parent;
    EXPECT_NEAR((t_.joints[j] - t_.joints[parent]).norm(), (joints_[j] - joints_[parent]).norm(), 1e-12);
  }
  for (const Eigen::Vector3d& turn : t_pose(body_, t_.joints).rotations) EXPECT_LT(turn.norm(), 1e-7);
}

TEST_F(TPose, TheHeadAndTrunkDoNotTurn) {
  for (const char* name : {"hips", "spine", "chest", "neck", "head", "leftShoulder"})
    EXPECT_EQ(pose_.rotations[body_.joint_index(name)].norm(), 0.0) << name;
}

}  // namespace
}  // namespace gyre
