// SPDX-License-Identifier: Apache-2.0
#include "tests/offload/avatar/vrm_rules.h"

#include <algorithm>
#include <list>
#include <map>
#include <set>

namespace gyre {

namespace {

using nlohmann::json;
using Words = std::set<std::string>;

struct Bone {
  std::string parent;  // the nearest bone above it that must be there, or may be
  bool required = false;
};

// The humanoid's tree (humanoid.md of the specification).
std::map<std::string, Bone> bone_rules() {
  std::map<std::string, Bone> bones = {{"hips", {"", true}},
                                       {"spine", {"hips", true}},
                                       {"chest", {"spine", false}},
                                       {"upperChest", {"chest", false}},
                                       {"neck", {"upperChest", false}},
                                       {"head", {"neck", true}},
                                       {"jaw", {"head", false}}};
  for (const std::string side : {"left", "right"}) {
    bones[side + "Eye"] = {"head", false};
    bones[side + "UpperLeg"] = {"hips", true};
    bones[side + "LowerLeg"] = {side + "UpperLeg", true};
    bones[side + "Foot"] = {side + "LowerLeg", true};
    bones[side + "Toes"] = {side + "Foot", false};
    bones[side + "Shoulder"] = {"upperChest", false};
    bones[side + "UpperArm"] = {side + "Shoulder", true};
    bones[side + "LowerArm"] = {side + "UpperArm", true};
    bones[side + "Hand"] = {side + "LowerArm", true};
    bones[side + "ThumbMetacarpal"] = {side + "Hand", false};
    bones[side + "ThumbProximal"] = {side + "ThumbMetacarpal", false};
    bones[side + "ThumbDistal"] = {side + "ThumbProximal", false};
    for (const std::string finger : {"Index", "Middle", "Ring", "Little"}) {
      bones[side + finger + "Proximal"] = {side + "Hand", false};
      bones[side + finger + "Intermediate"] = {side + finger + "Proximal", false};
      bones[side + finger + "Distal"] = {side + finger + "Intermediate", false};
    }
  }
  return bones;
}

// Bones that may only be there with their parent.
bool needs_parent(const std::string& bone) {
  for (const char* end : {"Intermediate", "Distal", "ThumbProximal"})
    if (bone.ends_with(end)) return true;
  return bone == "upperChest";
}

class Rules {
 public:
  explicit Rules(const json& gltf) : gltf_(gltf) {}

  std::vector<std::string> faults() {
    const json used = gltf_.value("extensionsUsed", json::array());
    if (std::find(used.begin(), used.end(), "VRMC_vrm") == used.end()) fault("extensionsUsed lacks VRMC_vrm");
    const json* vrm = object(gltf_.value("extensions", json::object()), "VRMC_vrm", "extensions");
    if (vrm == nullptr) return faults_;
    vrm_ = *vrm;
    known(vrm_, {"specVersion", "meta", "humanoid", "firstPerson", "lookAt", "expressions"}, "VRMC_vrm");
    if (vrm_.value("specVersion", json()) != "1.0") fault("specVersion is not 1.0");
    check_meta();
    check_humanoid();
    check_first_person();
    check_look_at();
    check_expressions();
    check_rest();
    return faults_;
  }

 private:
  void fault(const std::string& text) { faults_.push_back(text); }

  const json* object(const json& in, const char* name, const char* where) {
    kept_.push_back(in.value(name, json()));
    if (kept_.back().is_object()) return &kept_.back();
    fault(std::string(where) + "." + name + " is no object");
    return nullptr;
  }

  void known(const json& in, const Words& names, const std::string& where) {
    for (const auto& [name, value] : in.items())
      if (!names.contains(name)) fault(where + " has the unknown property " + name);
  }

  void one_of(const json& in, const char* name, const Words& values, const std::string& where) {
    if (!in.contains(name)) return;
    if (!in[name].is_string() || !values.contains(in[name].get<std::string>()))
      fault(where + "." + name + " is " + in[name].dump());
  }

  bool is_node(const json& in, const std::string& where) {
    const std::size_t nodes = gltf_.value("nodes", json::array()).size();
    const bool good = in.contains("node") && in["node"].is_number_integer() && in["node"].get<std::int64_t>() >= 0 &&
                      in["node"].get<std::size_t>() < nodes;
    if (!good) fault(where + " names no node");
    return good;
  }

  void check_meta() {
    const json* meta = object(vrm_, "meta", "VRMC_vrm");
    if (meta == nullptr) return;
    const Words texts = {
        "name",       "version",        "copyrightInformation", "contactInformation", "thirdPartyLicenses",
        "licenseUrl", "otherLicenseUrl"};
    const Words flags = {"allowExcessivelyViolentUsage", "allowExcessivelySexualUsage",
                         "allowPoliticalOrReligiousUsage", "allowAntisocialOrHateUsage", "allowRedistribution"};
    Words all = {"authors",         "references",     "thumbnailImage", "avatarPermission",
                 "commercialUsage", "creditNotation", "modification"};
    all.insert(texts.begin(), texts.end());
    all.insert(flags.begin(), flags.end());
    known(*meta, all, "meta");
    for (const std::string& name : texts)
      if (meta->contains(name) && !(*meta)[name].is_string()) fault("meta." + name + " is no text");
    for (const std::string& name : flags)
      if (meta->contains(name) && !(*meta)[name].is_boolean()) fault("meta." + name + " is no boolean");
    if (meta->value("name", "").empty()) fault("meta.name is missing");
    if (meta->value("licenseUrl", "") != "https://vrm.dev/licenses/1.0/") fault("meta.licenseUrl is not VRM's");
    const json authors = meta->value("authors", json());
    const bool texts_only = std::all_of(authors.begin(), authors.end(), [](const json& a) { return a.is_string(); });
    if (!authors.is_array() || authors.empty() || !texts_only) fault("meta.authors names nobody");
    one_of(*meta, "avatarPermission", {"onlyAuthor", "onlySeparatelyLicensedPerson", "everyone"}, "meta");
    one_of(*meta, "commercialUsage", {"personalNonProfit", "personalProfit", "corporation"}, "meta");
    one_of(*meta, "creditNotation", {"required", "unnecessary"}, "meta");
    one_of(*meta, "modification", {"prohibited", "allowModification", "allowModificationRedistribution"}, "meta");
  }

  void check_humanoid() {
    const json* humanoid = object(vrm_, "humanoid", "VRMC_vrm");
    if (humanoid == nullptr) return;
    known(*humanoid, {"humanBones"}, "humanoid");
    const json* bones = object(*humanoid, "humanBones", "humanoid");
    if (bones == nullptr) return;
    const auto rules = bone_rules();
    std::map<int, std::string> bone_of_node;
    for (const auto& [name, bone] : bones->items()) {
      if (!rules.contains(name)) fault("humanBones has the unknown bone " + name);
      known(bone, {"node"}, "humanBones." + name);
      if (!is_node(bone, "humanBones." + name)) continue;
      const auto [where, is_new] = bone_of_node.try_emplace(bone["node"].get<int>(), name);
      if (!is_new) fault(name + " and " + where->second + " are one node");
    }
    const std::vector<int> parents = node_parents();
    for (const auto& [name, rule] : rules) {
      if (!bones->contains(name)) {
        if (rule.required) fault("the bone " + name + " is missing");
        continue;
      }
      if (needs_parent(name) && !bones->contains(rule.parent)) fault(name + " is there without " + rule.parent);
      std::string wanted = rule.parent;
      while (!wanted.empty() && !bones->contains(wanted)) wanted = rules.at(wanted).parent;
      int node = parents.at((*bones)[name]["node"].get<std::size_t>());
      while (node >= 0 && !bone_of_node.contains(node)) node = parents.at(static_cast<std::size_t>(node));
      const std::string found = node < 0 ? "" : bone_of_node.at(node);
      if (found != wanted) fault(name + " is below '" + found + "' and not '" + wanted + "'");
    }
  }

  std::vector<int> node_parents() const {
    const json nodes = gltf_.value("nodes", json::array());
    std::vector<int> parents(nodes.size(), -1);
    for (std::size_t n = 0; n < nodes.size(); ++n)
      for (const int child : nodes[n].value("children", std::vector<int>()))
        parents.at(static_cast<std::size_t>(child)) = static_cast<int>(n);
    return parents;
  }

  void check_first_person() {
    if (!vrm_.contains("firstPerson")) return;
    known(vrm_["firstPerson"], {"meshAnnotations"}, "firstPerson");
    for (const json& annotation : vrm_["firstPerson"].value("meshAnnotations", json::array())) {
      known(annotation, {"node", "type"}, "meshAnnotations");
      is_node(annotation, "meshAnnotations");
      if (!annotation.contains("type")) fault("meshAnnotations lacks type");
      one_of(annotation, "type", {"auto", "both", "thirdPersonOnly", "firstPersonOnly"}, "meshAnnotations");
    }
  }

  void check_look_at() {
    if (!vrm_.contains("lookAt")) return;
    const json& look = vrm_["lookAt"];
    Words names = {"offsetFromHeadBone", "type"};
    for (const char* range :
         {"rangeMapHorizontalInner", "rangeMapHorizontalOuter", "rangeMapVerticalDown", "rangeMapVerticalUp"}) {
      names.insert(range);
      const json map = look.value(range, json::object());
      known(map, {"inputMaxValue", "outputScale"}, std::string("lookAt.") + range);
      for (const auto& [name, value] : map.items())
        if (!value.is_number()) fault(std::string("lookAt.") + range + "." + name + " is no number");
    }
    known(look, names, "lookAt");
    one_of(look, "type", {"bone", "expression"}, "lookAt");
    const json offset = look.value("offsetFromHeadBone", json::array({0, 0, 0}));
    const bool numbers = std::all_of(offset.begin(), offset.end(), [](const json& x) { return x.is_number(); });
    if (offset.size() != 3 || !numbers) fault("lookAt.offsetFromHeadBone is no vector");
  }

  void check_expression(const std::string& name, const json& expression) {
    known(expression,
          {"morphTargetBinds", "materialColorBinds", "textureTransformBinds", "isBinary", "overrideBlink",
           "overrideLookAt", "overrideMouth"},
          name);
    if (expression.contains("isBinary") && !expression["isBinary"].is_boolean())
      fault(name + ".isBinary is no boolean");
    for (const char* over : {"overrideBlink", "overrideLookAt", "overrideMouth"})
      one_of(expression, over, {"none", "block", "blend"}, name);
    for (const json& bind : expression.value("morphTargetBinds", json::array())) {
      known(bind, {"node", "index", "weight"}, name + ".morphTargetBinds");
      if (!is_node(bind, name + ".morphTargetBinds")) continue;
      const json& node = gltf_["nodes"][bind["node"].get<std::size_t>()];
      const json mesh = node.contains("mesh") ? gltf_["meshes"][node["mesh"].get<std::size_t>()] : json::object();
      const std::size_t targets = mesh.value("weights", json::array()).size();
      if (!bind.contains("index") || !bind["index"].is_number_integer() || bind["index"].get<std::size_t>() >= targets)
        fault(name + " binds no shape of its mesh");
      if (!bind.contains("weight") || !bind["weight"].is_number() || bind["weight"] < 0 || bind["weight"] > 1)
        fault(name + " binds with a weight outside 0 to 1");
    }
  }

  void check_expressions() {
    if (!vrm_.contains("expressions")) return;
    known(vrm_["expressions"], {"preset", "custom"}, "expressions");
    const Words presets = {"happy",      "angry",  "sad",      "relaxed",  "surprised", "aa",
                           "ih",         "ou",     "ee",       "oh",       "blink",     "blinkLeft",
                           "blinkRight", "lookUp", "lookDown", "lookLeft", "lookRight", "neutral"};
    const json preset = vrm_["expressions"].value("preset", json::object());
    known(preset, presets, "expressions.preset");
    for (const auto& [name, expression] : preset.items()) check_expression(name, expression);
    const json custom = vrm_["expressions"].value("custom", json::object());
    for (const auto& [name, expression] : custom.items()) {
      if (presets.contains(name)) fault("the custom expression " + name + " has the name of a preset");
      check_expression(name, expression);
    }
  }

  void check_rest() {
    for (const char* unwanted : {"animations", "cameras"})
      if (gltf_.contains(unwanted)) fault(std::string("it has ") + unwanted);
    for (const json& mesh : gltf_.value("meshes", json::array()))
      for (const json& primitive : mesh.value("primitives", json::array()))
        if (primitive.value("attributes", json::object()).contains("TANGENT")) fault("it has tangents");
    for (const json& node : gltf_.value("nodes", json::array())) {
      const json scale = node.value("scale", json::array({1, 1, 1}));
      if (scale[0] != scale[1] || scale[0] != scale[2] || scale[0] <= 0)
        fault("the scale of " + node.value("name", "a node") + " is not positive and uniform");
    }
  }

  const json& gltf_;
  json vrm_;
  std::list<json> kept_;
  std::vector<std::string> faults_;
};

}  // namespace

std::vector<std::string> vrm_faults(const json& gltf) {
  return Rules(gltf).faults();
}

}  // namespace gyre
