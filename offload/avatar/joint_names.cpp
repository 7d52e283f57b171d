// SPDX-License-Identifier: Apache-2.0
#include "offload/avatar/joint_names.h"

#include "offload/body/humanoid.h"

#include <array>

namespace gyre {

namespace {

// The bone's name without its side, and the names of the left one or the only one in each naming.
struct Names {
  std::string_view vrm, mixamo, unreal;
};

constexpr std::array<Names, 17> all_names = {{{"hips", "Hips", "pelvis"},
                                              {"spine", "Spine", "spine_01"},
                                              {"chest", "Spine1", "spine_02"},
                                              {"upperChest", "Spine2", "spine_03"},
                                              {"neck", "Neck", "neck_01"},
                                              {"head", "Head", "head"},
                                              {"jaw", "Jaw", "jaw"},
                                              {"Eye", "Eye", "eye"},
                                              {"UpperLeg", "UpLeg", "thigh"},
                                              {"LowerLeg", "Leg", "calf"},
                                              {"Foot", "Foot", "foot"},
                                              {"Toes", "ToeBase", "ball"},
                                              {"Shoulder", "Shoulder", "clavicle"},
                                              {"UpperArm", "Arm", "upperarm"},
                                              {"LowerArm", "ForeArm", "lowerarm"},
                                              {"Hand", "Hand", "hand"},
                                              {"Little", "Pinky", "pinky"}}};

struct Finger {
  std::string_view name;
  int segment;  // from the palm, 1 ... 3
};

std::optional<Finger> finger_of(std::string_view plain) {
  for (const std::string_view finger : {"Thumb", "Index", "Middle", "Ring", "Little"}) {
    if (!plain.starts_with(finger)) continue;
    const std::string_view segment = plain.substr(finger.size());
    if (segment == "Metacarpal") return Finger{finger, 1};
    if (segment == "Proximal") return Finger{finger, finger == "Thumb" ? 2 : 1};
    if (segment == "Intermediate") return Finger{finger, 2};
    if (segment == "Distal") return Finger{finger, 3};
  }
  return std::nullopt;
}

std::string_view other_name(std::string_view vrm, JointNaming naming) {
  for (const Names& names : all_names)
    if (names.vrm == vrm) return naming == JointNaming::mixamo ? names.mixamo : names.unreal;
  return vrm;
}

std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

}  // namespace

std::optional<JointNaming> joint_naming(std::string_view word) {
  if (word == "vrm") return JointNaming::vrm;
  if (word == "mixamo") return JointNaming::mixamo;
  if (word == "unreal") return JointNaming::unreal;
  return std::nullopt;
}

std::string joint_name(std::string_view vrm_bone, JointNaming naming) {
  if (naming == JointNaming::vrm || humanoid_bone(vrm_bone) < 0) return std::string(vrm_bone);
  const bool left = vrm_bone.starts_with("left"), right = vrm_bone.starts_with("right");
  const std::string_view plain = vrm_bone.substr(left ? 4 : right ? 5 : 0);
  const auto finger = finger_of(plain);
  if (naming == JointNaming::mixamo) {
    const std::string side = left ? "Left" : right ? "Right" : "";
    const std::string part =
        finger ? "Hand" + std::string(other_name(finger->name, naming)) + std::to_string(finger->segment)
               : std::string(other_name(plain, naming));
    return "mixamorig:" + side + part;
  }
  const std::string side = left ? "_l" : right ? "_r" : "";
  if (finger) return lower(other_name(finger->name, naming)) + "_0" + std::to_string(finger->segment) + side;
  return std::string(other_name(plain, naming)) + side;
}

}  // namespace gyre
