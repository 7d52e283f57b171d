// SPDX-License-Identifier: Apache-2.0
#include "offload/body/humanoid.h"

namespace gyre {
namespace {

std::vector<HumanoidBone> make_bones() {
  std::vector<HumanoidBone> bones;
  auto add = [&](std::string name, int parent) {
    bones.push_back({std::move(name), parent});
    return static_cast<int>(bones.size()) - 1;
  };
  const int hips = add("hips", -1);
  const int spine = add("spine", hips);
  const int chest = add("chest", spine);
  const int upper_chest = add("upperChest", chest);
  const int neck = add("neck", upper_chest);
  const int head = add("head", neck);
  add("leftEye", head);
  add("rightEye", head);
  add("jaw", head);
  for (const std::string side : {"left", "right"}) {
    const int upper_leg = add(side + "UpperLeg", hips);
    const int lower_leg = add(side + "LowerLeg", upper_leg);
    const int foot = add(side + "Foot", lower_leg);
    add(side + "Toes", foot);
  }
  for (const std::string side : {"left", "right"}) {
    const int shoulder = add(side + "Shoulder", upper_chest);
    const int upper_arm = add(side + "UpperArm", shoulder);
    const int lower_arm = add(side + "LowerArm", upper_arm);
    const int hand = add(side + "Hand", lower_arm);
    const int thumb = add(side + "ThumbMetacarpal", hand);
    add(side + "ThumbDistal", add(side + "ThumbProximal", thumb));
    for (const std::string finger : {"Index", "Middle", "Ring", "Little"}) {
      const int proximal = add(side + finger + "Proximal", hand);
      add(side + finger + "Distal", add(side + finger + "Intermediate", proximal));
    }
  }
  return bones;
}

}  // namespace

const std::vector<HumanoidBone>& humanoid_bones() {
  static const std::vector<HumanoidBone> bones = make_bones();
  return bones;
}

int humanoid_bone(std::string_view name) {
  const auto& bones = humanoid_bones();
  for (std::size_t i = 0; i < bones.size(); ++i)
    if (bones[i].name == name) return static_cast<int>(i);
  return -1;
}

std::string mirrored_name(std::string_view name) {
  const auto swapped = [&](std::string_view from, std::string_view to) -> std::string {
    if (name.starts_with(from)) return std::string(to) + std::string(name.substr(from.size()));
    return {};
  };
  if (std::string s = swapped("left", "right"); !s.empty()) return s;
  if (std::string s = swapped("right", "left"); !s.empty()) return s;
  if (name.ends_with("Left")) return std::string(name.substr(0, name.size() - 4)) + "Right";
  if (name.ends_with("Right")) return std::string(name.substr(0, name.size() - 5)) + "Left";
  return std::string(name);
}

const std::array<std::string_view, 52>& arkit_expressions() {
  static constexpr std::array<std::string_view, 52> names = {
      "browDownLeft",      "browDownRight",      "browInnerUp",         "browOuterUpLeft",
      "browOuterUpRight",  "cheekPuff",          "cheekSquintLeft",     "cheekSquintRight",
      "eyeBlinkLeft",      "eyeBlinkRight",      "eyeLookDownLeft",     "eyeLookDownRight",
      "eyeLookInLeft",     "eyeLookInRight",     "eyeLookOutLeft",      "eyeLookOutRight",
      "eyeLookUpLeft",     "eyeLookUpRight",     "eyeSquintLeft",       "eyeSquintRight",
      "eyeWideLeft",       "eyeWideRight",       "jawForward",          "jawLeft",
      "jawOpen",           "jawRight",           "mouthClose",          "mouthDimpleLeft",
      "mouthDimpleRight",  "mouthFrownLeft",     "mouthFrownRight",     "mouthFunnel",
      "mouthLeft",         "mouthLowerDownLeft", "mouthLowerDownRight", "mouthPressLeft",
      "mouthPressRight",   "mouthPucker",        "mouthRight",          "mouthRollLower",
      "mouthRollUpper",    "mouthShrugLower",    "mouthShrugUpper",     "mouthSmileLeft",
      "mouthSmileRight",   "mouthStretchLeft",   "mouthStretchRight",   "mouthUpperUpLeft",
      "mouthUpperUpRight", "noseSneerLeft",      "noseSneerRight",      "tongueOut"};
  return names;
}

const std::array<std::string_view, 15>& oculus_visemes() {
  static constexpr std::array<std::string_view, 15> names = {
      "viseme_sil", "viseme_PP", "viseme_FF", "viseme_TH", "viseme_DD", "viseme_kk", "viseme_CH", "viseme_SS",
      "viseme_nn",  "viseme_RR", "viseme_aa", "viseme_E",  "viseme_I",  "viseme_O",  "viseme_U"};
  return names;
}

}  // namespace gyre
