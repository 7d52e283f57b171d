// SPDX-License-Identifier: Apache-2.0
// The human template's evaluation, and the built-in human.
#include "offload/body/template.h"

#include "offload/body/expression_check.h"
#include "offload/body/humanoid.h"
#include "offload/body/landmark_set.h"
#include "offload/body/template_check.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

const BodyTemplate& human() {
  static const BodyTemplate body = built_in_template();
  return body;
}

BodyPose rest_pose() {
  BodyPose pose;
  pose.rotations.assign(human().joints.size(), Eigen::Vector3d::Zero());
  return pose;
}

// Every joint turned a little, differently.
BodyPose busy_pose() {
  BodyPose pose = rest_pose();
  pose.translation = {0.3, -0.1, 0.7};
  for (std::size_t j = 0; j < pose.rotations.size(); ++j) {
    const double k = static_cast<double>(j);
    pose.rotations[j] = 0.15 * Eigen::Vector3d(std::sin(k), std::cos(2 * k), std::sin(3 * k + 1));
  }
  return pose;
}

double largest_distance(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, (a[i] - b[i]).norm());
  return largest;
}

TEST(Skinning, RestPoseMovesNothing) {
  const auto& rest = human().mesh.vertices;
  const auto posed =
      skin_vertices(human(), rest, joint_transforms(human(), joint_positions(human(), rest), rest_pose()));
  EXPECT_LT(largest_distance(posed, rest), 1e-6);
}

TEST(Skinning, RootMovesAllRigidly) {
  const auto& rest = human().mesh.vertices;
  const auto joints = joint_positions(human(), rest);
  BodyPose pose = rest_pose();
  pose.translation = {1, 2, 3};
  pose.rotations[0] = {0, 0.7, 0};
  const auto posed = skin_vertices(human(), rest, joint_transforms(human(), joints, pose));
  const Eigen::AngleAxisd turn(0.7, Eigen::Vector3d::UnitY());
  for (std::size_t v = 0; v < rest.size(); v += 97) {
    const Eigen::Vector3d expected = turn * (rest[v] - joints[0]) + joints[0] + pose.translation;
    EXPECT_LT((posed[v] - expected).norm(), 1e-5);
  }
}

TEST(Skinning, ChildrenFollowTheirParents) {
  const auto joints = joint_positions(human(), human().mesh.vertices);
  BodyPose pose = rest_pose();
  const int elbow = human().joint_index("leftLowerArm"), hand = human().joint_index("leftHand");
  pose.rotations[elbow] = {0, 0, 1.2};
  const auto transforms = joint_transforms(human(), joints, pose);
  const Eigen::Vector3d expected =
      joints[elbow] + Eigen::AngleAxisd(1.2, Eigen::Vector3d::UnitZ()) * (joints[hand] - joints[elbow]);
  EXPECT_LT((transforms[hand] * joints[hand] - expected).norm(), 1e-12);
  EXPECT_LT((transforms[elbow] * joints[elbow] - joints[elbow]).norm(), 1e-12);
}

TEST(Skinning, UnskinUndoesSkin) {
  const auto& rest = human().mesh.vertices;
  const auto transforms = joint_transforms(human(), joint_positions(human(), rest), busy_pose());
  EXPECT_LT(largest_distance(unskin_vertices(human(), skin_vertices(human(), rest, transforms), transforms), rest),
            1e-9);
}

TEST(Shape, JointsFollowTheShape) {
  const Eigen::VectorXd shape = Eigen::VectorXd::Unit(static_cast<Eigen::Index>(human().shapes.size()), 0);
  const auto taller = shaped_vertices(human(), shape);
  const auto joints = joint_positions(human(), taller), mean_joints = joint_positions(human(), human().mesh.vertices);
  // The built-in human's first component grows everything by 4 % about the origin.
  for (std::size_t j = 0; j < joints.size(); ++j) EXPECT_NEAR(joints[j].norm(), 1.04 * mean_joints[j].norm(), 0.01);
  EXPECT_EQ(largest_distance(shaped_vertices(human(), Eigen::VectorXd()), human().mesh.vertices), 0);
}

TEST(Shape, LegLengthKeepsTheStature) {
  Eigen::VectorXd shape = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(human().shapes.size()));
  shape[2] = 2;
  const auto longer = shaped_vertices(human(), shape);
  const int crown = human().landmarks.at("crown"), crotch = human().landmarks.at("crotch");
  EXPECT_NEAR(longer[crown].y(), human().mesh.vertices[crown].y(), 1e-3);
  EXPECT_GT(longer[crotch].y(), human().mesh.vertices[crotch].y() + 0.02);
}

TEST(BuiltIn, PassesTheCheck) {
  for (const TemplateFinding& finding : check_template(human())) EXPECT_FALSE(finding.is_error) << finding.what;
}

TEST(BuiltIn, IsAClosedManifoldOfTheExpectedSize) {
  const EdgeReport edges = check_edges(human().mesh.triangles);
  EXPECT_EQ(edges.open + edges.crowded + edges.flipped, 0);
  EXPECT_EQ(edges.euler, 2);
  EXPECT_GT(human().mesh.triangles.size(), 6000U);
  EXPECT_LT(human().mesh.triangles.size(), 14000U);
  EXPECT_EQ(human().joints.size(), 55U);
  EXPECT_TRUE(human().built_in);
  EXPECT_TRUE(human().expressions.empty());
}

TEST(BuiltIn, IsTheSameEveryTime) {
  const BodyTemplate again = built_in_template();
  EXPECT_EQ(again.checksum, human().checksum);
  EXPECT_EQ(largest_distance(again.mesh.vertices, human().mesh.vertices), 0);
}

TEST(BuiltIn, IsSymmetric) {
  for (std::size_t v = 0; v < human().mirror.size(); ++v) ASSERT_GE(human().mirror[v], 0);
  const auto joints = joint_positions(human(), human().mesh.vertices);
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const Eigen::Vector3d twin = joints[human().joint_index(mirrored_name(human().joints[j].name))];
    EXPECT_LT((joints[j] - Eigen::Vector3d(-twin.x(), twin.y(), twin.z())).norm(), 1e-9) << human().joints[j].name;
  }
  EXPECT_GT(joints[human().joint_index("leftHand")].x(), 0.3);
}

TEST(Check, FindsWhatIsBroken) {
  BodyTemplate broken = human();
  broken.skin[10].weight[0] += 0.5F;
  broken.mesh.triangles.pop_back();
  broken.mesh.uv_triangles.pop_back();
  broken.mesh.uv[5].x() = 1.5;
  --broken.parts[0].triangle_count;
  std::string all;
  for (const TemplateFinding& finding : check_template(broken))
    if (finding.is_error) all += finding.what + "\n";
  EXPECT_NE(all.find("open edges"), std::string::npos) << all;
  EXPECT_NE(all.find("sum to 1"), std::string::npos) << all;
  EXPECT_NE(all.find("outside [0, 1]"), std::string::npos) << all;
}

std::string faults_of(const BodyTemplate& body) {
  std::string all;
  for (const std::string& fault : expression_faults(body)) all += fault + "\n";
  return all;
}

// A face of four landmarks above a chin, and the expressions that move them.
TEST(Check, ExpressionsMustDoWhatTheirNamesSay) {
  BodyTemplate body;
  body.mesh.vertices = {{0.03, 1.61, 0.1}, {0.03, 1.60, 0.1}, {0.025, 1.53, 0.1}, {-0.025, 1.53, 0.1}, {0, 1.48, 0.1}};
  body.landmarks = {
      {"leftUpperLid", 0}, {"leftLowerLid", 1}, {"leftMouthCorner", 2}, {"rightMouthCorner", 3}, {"chin", 4}};
  const auto only = [&](const Morph& morph) {
    body.expressions = {morph};
    const std::string all = faults_of(body);
    return all.substr(0, all.find("no expression"));
  };
  EXPECT_EQ(only({"eyeBlinkLeft", {0, 1}, {{0, -0.008F, 0}, {0, 0.001F, 0}}}), "");
  EXPECT_NE(only({"eyeBlinkLeft", {0}, {{0, -0.004F, 0}}}).find("eyeBlinkLeft changes the distance"),
            std::string::npos);
  EXPECT_NE(only({"eyeBlinkRight", {0, 1}, {{0, -0.008F, 0}, {0, 0.001F, 0}}}).find("other side"), std::string::npos);
  EXPECT_EQ(only({"jawOpen", {4}, {{0, -0.03F, 0}}}), "");
  EXPECT_NE(only({"jawOpen", {4}, {{0, 0.03F, 0}}}).find("chin"), std::string::npos);
  EXPECT_EQ(only({"jawLeft", {4}, {{0.01F, 0, 0}}}), "");
  EXPECT_NE(only({"jawRight", {4}, {{0.01F, 0, 0}}}).find("chin"), std::string::npos);
  EXPECT_EQ(only({"mouthStretchRight", {3}, {{-0.01F, 0, 0}}}), "");
  EXPECT_NE(only({"mouthStretchRight", {3}, {{0.01F, 0, 0}}}).find("rightMouthCorner"), std::string::npos);
  EXPECT_EQ(only({"mouthPucker", {2, 3}, {{-0.005F, 0, 0}, {0.005F, 0, 0}}}), "");
  EXPECT_NE(only({"mouthPucker", {2, 3}, {{0.005F, 0, 0}, {-0.005F, 0, 0}}}).find("narrow"), std::string::npos);
  EXPECT_NE(only({"browInnerUp", {0}, {{0, -0.01F, 0}}}).find("wrong way"), std::string::npos);
  EXPECT_NE(only({"smirk", {0}, {{0, 0.01F, 0}}}).find("unknown expression smirk"), std::string::npos);
  EXPECT_NE(only({"cheekPuff", {}, {}}).find("moves nothing"), std::string::npos);
  EXPECT_EQ(only({"viseme_sil", {}, {}}), "");
  body.expressions.clear();
  EXPECT_NE(faults_of(body).find("no expression viseme_aa"), std::string::npos);
}

TEST(Check, SaysThatTheBuiltInHumanHasNoFace) {
  const auto findings = check_template(human());
  EXPECT_TRUE(std::any_of(findings.begin(), findings.end(), [](const TemplateFinding& finding) {
    return !finding.is_error && finding.what.find("no face rig") != std::string::npos;
  }));
}

TEST(Check, WindingNumberTellsInsideFromOutside) {
  const auto& mesh = human().mesh;
  EXPECT_NEAR(winding_number(mesh.vertices, mesh.triangles, {0, 1.1, 0}), 1, 1e-6);
  EXPECT_NEAR(winding_number(mesh.vertices, mesh.triangles, {0, 1.1, 0.5}), 0, 1e-6);
}

TEST(Humanoid, HasTheBonesOfVrmAndTheExpressionsOfArkit) {
  EXPECT_EQ(humanoid_bones().size(), 55U);
  for (std::size_t i = 0; i < humanoid_bones().size(); ++i) EXPECT_LT(humanoid_bones()[i].parent, static_cast<int>(i));
  EXPECT_EQ(humanoid_bones()[humanoid_bones()[humanoid_bone("leftIndexProximal")].parent].name, "leftHand");
  EXPECT_TRUE(std::is_sorted(arkit_expressions().begin(), arkit_expressions().end()));
  EXPECT_EQ(mirrored_name("leftHand"), "rightHand");
  EXPECT_EQ(mirrored_name("eyeBlinkRight"), "eyeBlinkLeft");
  EXPECT_EQ(mirrored_name("jaw"), "jaw");
  EXPECT_EQ(std::set(oculus_visemes().begin(), oculus_visemes().end()).size(), 15U);
  EXPECT_EQ(landmark_names().size(), 55U);
  for (const auto& [name, vertex] : human().landmarks)
    EXPECT_EQ(std::count(landmark_names().begin(), landmark_names().end(), name), 1) << name;
}

}  // namespace
}  // namespace gyre
