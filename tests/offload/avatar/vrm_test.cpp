// SPDX-License-Identifier: Apache-2.0
#include "offload/avatar/vrm.h"

#include "offload/avatar/rebind.h"
#include "offload/body/t_pose.h"
#include "tests/offload/avatar/vrm_rules.h"

#include <gtest/gtest.h>
#include <cstring>

namespace gyre {
namespace {

// The built-in human with two shapes, in T-pose.
class Vrm : public testing::Test {
 protected:
  void SetUp() override {
    body_.expressions = {{"eyeBlinkLeft", {5}, {{0, -0.01F, 0}}}, {"eyeBlinkRight", {6}, {{0, -0.01F, 0}}}};
    const std::vector<Eigen::Vector3d> joints = joint_positions(body_, body_.mesh.vertices);
    const ReposedSurface reposed = repose(body_, body_.mesh.vertices, joints, t_pose(body_, joints));
    avatar_ = rebound(*assemble_avatar(body_, body_.mesh.vertices, joints), reposed.reposed_from_rest);
    for (const Joint& joint : body_.joints) bones_.push_back(joint.name);
  }

  nlohmann::json gltf() const {
    const auto bytes = write_vrm(avatar_, bones_);
    EXPECT_TRUE(bytes);
    std::uint32_t length = 0;
    std::memcpy(&length, bytes->data() + 12, sizeof length);
    return nlohmann::json::parse(std::string(reinterpret_cast<const char*>(bytes->data()) + 20, length));
  }

  BodyTemplate body_ = built_in_template();
  Avatar avatar_;
  std::vector<std::string> bones_;
};

TEST_F(Vrm, BindsEveryBoneToItsNode) {
  const nlohmann::json file = gltf(), vrm = file.at("extensions").at("VRMC_vrm");
  EXPECT_EQ(file.at("extensionsUsed"), nlohmann::json::array({"VRMC_vrm"}));
  EXPECT_EQ(vrm.at("specVersion"), "1.0");
  for (const auto& [bone, entry] : vrm.at("humanoid").at("humanBones").items())
    EXPECT_EQ(file.at("nodes").at(entry.at("node").get<std::size_t>()).at("name"), bone);
  EXPECT_EQ(vrm.at("humanoid").at("humanBones").size(), bones_.size());
  EXPECT_EQ(vrm.at("firstPerson").at("meshAnnotations").at(0).at("node"), bones_.size());
}

TEST_F(Vrm, AllowsNothingByDefault) {
  const nlohmann::json meta = gltf().at("extensions").at("VRMC_vrm").at("meta");
  EXPECT_EQ(meta.at("licenseUrl"), "https://vrm.dev/licenses/1.0/");
  EXPECT_FALSE(meta.at("authors").empty());
  EXPECT_EQ(meta.at("avatarPermission"), "onlyAuthor");
  EXPECT_EQ(meta.at("commercialUsage"), "personalNonProfit");
  EXPECT_EQ(meta.at("modification"), "prohibited");
  for (const char* permission : {"allowExcessivelyViolentUsage", "allowExcessivelySexualUsage", "allowRedistribution",
                                 "allowPoliticalOrReligiousUsage", "allowAntisocialOrHateUsage"})
    EXPECT_EQ(meta.at(permission), false) << permission;
}

TEST_F(Vrm, MakesPresetsOfTheShapesThatAreThere) {
  const nlohmann::json expressions = gltf().at("extensions").at("VRMC_vrm").at("expressions");
  EXPECT_EQ(expressions.at("preset").at("blink").at("morphTargetBinds").size(), 2U);
  EXPECT_EQ(expressions.at("preset").at("blinkRight").at("morphTargetBinds").at(0).at("index"), 1);
  EXPECT_FALSE(expressions.at("preset").contains("aa"));
  EXPECT_EQ(expressions.at("custom").size(), 2U);
}

TEST_F(Vrm, KeepsTheRulesOfTheSpecification) {
  EXPECT_EQ(vrm_faults(gltf()), std::vector<std::string>());
}

TEST_F(Vrm, TheRulesFindWhatIsWrong) {
  using nlohmann::json;
  const json good = gltf();
  const auto faults_with = [&](const char* pointer, const json& value) {
    json changed = good;
    changed[json::json_pointer(std::string("/extensions/VRMC_vrm") + pointer)] = value;
    return vrm_faults(changed).size();
  };
  const json hips = good["extensions"]["VRMC_vrm"]["humanoid"]["humanBones"]["hips"];
  EXPECT_EQ(faults_with("/specVersion", "0.0"), 1U);
  EXPECT_EQ(faults_with("/meta/authors", json::array()), 1U);
  EXPECT_EQ(faults_with("/meta/licence", "mine"), 1U);
  EXPECT_EQ(faults_with("/meta/modification", "ask"), 1U);
  EXPECT_EQ(faults_with("/lookAt/type", "head"), 1U);
  EXPECT_EQ(faults_with("/expressions/preset/blink/morphTargetBinds/0/index", 99), 1U);
  EXPECT_EQ(faults_with("/expressions/preset/wink", json::object()), 1U);
  EXPECT_GE(faults_with("/humanoid/humanBones/leftFoot", hips), 2U);  // one node twice, and not below its leg
  EXPECT_GE(faults_with("/humanoid/humanBones/tail", hips), 1U);
}

TEST_F(Vrm, StandsInTheTPose) {
  const auto at = [&](const char* joint) { return avatar_.joints[body_.joint_index(joint)].position; };
  for (const std::string side : {"left", "right"}) {
    const Eigen::Vector3d arm = at((side + "Hand").c_str()) - at((side + "UpperArm").c_str());
    EXPECT_LT(std::hypot(arm.y(), arm.z()), 1e-6 * arm.norm()) << side;
    const Eigen::Vector3d leg = at((side + "Foot").c_str()) - at((side + "UpperLeg").c_str());
    EXPECT_LT(std::hypot(leg.x(), leg.z()), 1e-6 * leg.norm()) << side;
  }
  float lowest = 1;
  for (const Eigen::Vector3f& p : avatar_.positions) lowest = std::min(lowest, p.y());
  EXPECT_NEAR(lowest, 0, 1e-6);
}

TEST_F(Vrm, SaysWhichBoneIsMissing) {
  bones_[body_.joint_index("leftHand")] = "";
  const auto result = write_vrm(avatar_, bones_);
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().message().find("leftHand"), std::string::npos);
}

}  // namespace
}  // namespace gyre
