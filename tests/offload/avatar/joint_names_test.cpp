// SPDX-License-Identifier: Apache-2.0
#include "offload/avatar/joint_names.h"

#include "offload/body/humanoid.h"

#include <gtest/gtest.h>
#include <set>

namespace gyre {
namespace {

TEST(JointNames, AreThoseOfTheOtherPrograms) {
  const auto expect = [](const char* bone, const char* mixamo, const char* unreal) {
    EXPECT_EQ(joint_name(bone, JointNaming::vrm), bone);
    EXPECT_EQ(joint_name(bone, JointNaming::mixamo), mixamo);
    EXPECT_EQ(joint_name(bone, JointNaming::unreal), unreal);
  };
  expect("hips", "mixamorig:Hips", "pelvis");
  expect("upperChest", "mixamorig:Spine2", "spine_03");
  expect("leftUpperArm", "mixamorig:LeftArm", "upperarm_l");
  expect("rightLowerLeg", "mixamorig:RightLeg", "calf_r");
  expect("leftThumbMetacarpal", "mixamorig:LeftHandThumb1", "thumb_01_l");
  expect("leftThumbDistal", "mixamorig:LeftHandThumb3", "thumb_03_l");
  expect("rightLittleIntermediate", "mixamorig:RightHandPinky2", "pinky_02_r");
  expect("leftEye", "mixamorig:LeftEye", "eye_l");
}

TEST(JointNames, AreDifferentForEveryBone) {
  for (const JointNaming naming : {JointNaming::vrm, JointNaming::mixamo, JointNaming::unreal}) {
    std::set<std::string> names;
    for (const HumanoidBone& bone : humanoid_bones()) names.insert(joint_name(bone.name, naming));
    EXPECT_EQ(names.size(), humanoid_bones().size());
  }
}

TEST(JointNames, LeaveOtherJointsAlone) {
  EXPECT_EQ(joint_name("tail", JointNaming::unreal), "tail");
  EXPECT_FALSE(joint_naming("maya"));
  EXPECT_EQ(joint_naming("unreal"), JointNaming::unreal);
}

}  // namespace
}  // namespace gyre
