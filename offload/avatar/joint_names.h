// SPDX-License-Identifier: Apache-2.0
// What other programs call the humanoid bones.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace gyre {

enum class JointNaming { vrm, mixamo, unreal };

// "vrm", "mixamo" or "unreal"; nothing for another word.
std::optional<JointNaming> joint_naming(std::string_view word);

// The name of a VRM 1.0 humanoid bone ("leftUpperArm") in a naming: "leftUpperArm", "mixamorig:LeftArm", "upperarm_l".
// A bone that the naming does not know follows its pattern; a name that is no humanoid bone stays.
std::string joint_name(std::string_view vrm_bone, JointNaming naming);

}  // namespace gyre
