// SPDX-License-Identifier: Apache-2.0
#include "offload/avatar/vrm.h"

#include "offload/avatar/glb.h"

#include <algorithm>
#include <array>

namespace gyre {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::array<const char*, 15> required_bones = {
    "hips",         "spine",         "head",          "leftUpperArm",  "leftLowerArm",
    "leftHand",     "rightUpperArm", "rightLowerArm", "rightHand",     "leftUpperLeg",
    "leftLowerLeg", "leftFoot",      "rightUpperLeg", "rightLowerLeg", "rightFoot"};

struct Part {
  const char* shape;
  double weight;
};

struct Preset {
  const char* name;
  std::vector<Part> parts;
};

const std::vector<Preset>& presets() {
  static const std::vector<Preset> all = {
      {"happy",
       {{"mouthSmileLeft", 0.8}, {"mouthSmileRight", 0.8}, {"cheekSquintLeft", 0.5}, {"cheekSquintRight", 0.5}}},
      {"angry",
       {{"browDownLeft", 1},
        {"browDownRight", 1},
        {"noseSneerLeft", 0.4},
        {"noseSneerRight", 0.4},
        {"mouthFrownLeft", 0.4},
        {"mouthFrownRight", 0.4},
        {"eyeSquintLeft", 0.4},
        {"eyeSquintRight", 0.4}}},
      {"sad", {{"browInnerUp", 0.8}, {"mouthFrownLeft", 0.7}, {"mouthFrownRight", 0.7}, {"mouthShrugLower", 0.3}}},
      {"relaxed", {{"mouthSmileLeft", 0.35}, {"mouthSmileRight", 0.35}, {"eyeBlinkLeft", 0.2}, {"eyeBlinkRight", 0.2}}},
      {"surprised",
       {{"browInnerUp", 0.7},
        {"browOuterUpLeft", 0.8},
        {"browOuterUpRight", 0.8},
        {"eyeWideLeft", 0.8},
        {"eyeWideRight", 0.8},
        {"jawOpen", 0.35}}},
      {"aa", {{"viseme_aa", 1}}},
      {"ih", {{"viseme_I", 1}}},
      {"ou", {{"viseme_U", 1}}},
      {"ee", {{"viseme_E", 1}}},
      {"oh", {{"viseme_O", 1}}},
      {"blink", {{"eyeBlinkLeft", 1}, {"eyeBlinkRight", 1}}},
      {"blinkLeft", {{"eyeBlinkLeft", 1}}},
      {"blinkRight", {{"eyeBlinkRight", 1}}}};
  return all;
}

class Expressions {
 public:
  // The mesh node that carries the shapes.
  Expressions(const Avatar& avatar, std::size_t node) : avatar_(avatar), node_(node) {}

  // Nothing when the avatar has none of the shapes.
  Json expression(const std::vector<Part>& parts) const {
    Json binds = Json::array();
    for (const Part& part : parts) {
      const auto found = std::find_if(avatar_.morphs.begin(), avatar_.morphs.end(),
                                      [&](const AvatarMorph& m) { return m.name == part.shape; });
      if (found == avatar_.morphs.end()) continue;
      binds.push_back({{"node", node_}, {"index", found - avatar_.morphs.begin()}, {"weight", part.weight}});
    }
    if (binds.empty()) return {};
    return {{"morphTargetBinds", binds},
            {"isBinary", false},
            {"overrideBlink", "none"},
            {"overrideLookAt", "none"},
            {"overrideMouth", "none"}};
  }

  Json all() const {
    Json expressions;
    for (const Preset& preset : presets())
      if (Json made = expression(preset.parts); !made.is_null()) expressions["preset"][preset.name] = std::move(made);
    for (const AvatarMorph& morph : avatar_.morphs)
      expressions["custom"][morph.name] = expression({{morph.name.c_str(), 1.0}});
    return expressions;
  }

 private:
  const Avatar& avatar_;
  std::size_t node_;
};

// Eyes turn as far as those of people do without the head: outputs are degrees of the eye joints.
Json look_at(const Avatar& avatar, int head, int left_eye, int right_eye) {
  const Eigen::Vector3d offset =
      0.5 * (avatar.joints[left_eye].position + avatar.joints[right_eye].position) - avatar.joints[head].position;
  const auto range = [](double most) { return Json{{"inputMaxValue", 90.0}, {"outputScale", most}}; };
  return {{"type", "bone"},
          {"offsetFromHeadBone", {offset.x(), offset.y(), offset.z()}},
          {"rangeMapHorizontalInner", range(12)},
          {"rangeMapHorizontalOuter", range(14)},
          {"rangeMapVerticalDown", range(10)},
          {"rangeMapVerticalUp", range(10)}};
}

}  // namespace

Result<std::vector<std::byte>> write_vrm(const Avatar& avatar, const std::vector<std::string>& bones,
                                         const VrmMeta& meta) {
  const auto joint_of = [&](std::string_view bone) {
    const auto found = std::find(bones.begin(), bones.end(), bone);
    return found == bones.end() ? -1 : static_cast<int>(found - bones.begin());
  };
  for (const char* bone : required_bones)
    if (joint_of(bone) < 0)
      return fail("a VRM needs a bone that the template lacks", bone, "name the template's joints as VRM does");

  Json human_bones;
  for (std::size_t j = 0; j < bones.size(); ++j)
    if (!bones[j].empty()) human_bones[bones[j]] = {{"node", j}};
  const std::size_t mesh_node = avatar.joints.size();
  Json vrm = {{"specVersion", "1.0"},
              {"meta",
               {{"name", meta.name},
                {"version", "1"},
                {"authors", {meta.author}},
                {"licenseUrl", "https://vrm.dev/licenses/1.0/"},
                {"avatarPermission", "onlyAuthor"},
                {"allowExcessivelyViolentUsage", false},
                {"allowExcessivelySexualUsage", false},
                {"commercialUsage", "personalNonProfit"},
                {"allowPoliticalOrReligiousUsage", false},
                {"allowAntisocialOrHateUsage", false},
                {"creditNotation", "required"},
                {"allowRedistribution", false},
                {"modification", "prohibited"}}},
              {"humanoid", {{"humanBones", human_bones}}},
              {"firstPerson", {{"meshAnnotations", Json::array({{{"node", mesh_node}, {"type", "auto"}}})}}}};
  const int head = joint_of("head"), left_eye = joint_of("leftEye"), right_eye = joint_of("rightEye");
  if (left_eye >= 0 && right_eye >= 0) vrm["lookAt"] = look_at(avatar, head, left_eye, right_eye);
  if (Json expressions = Expressions(avatar, mesh_node).all(); !expressions.is_null())
    vrm["expressions"] = std::move(expressions);
  return write_glb(avatar, {{"VRMC_vrm", vrm}});
}

}  // namespace gyre
