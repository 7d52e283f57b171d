// SPDX-License-Identifier: Apache-2.0
#include "offload/report/truth.h"

#include "common/bundle/atomic_file.h"
#include "common/bundle/bundle.h"
#include "common/mesh/mesh_io.h"

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

namespace gyre {

namespace {

using nlohmann::json;

// Throws json::exception when the text is not what it should be.
Pose pose_from(const json& rows) {
  Eigen::Matrix3d rotation;
  Pose pose;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) rotation(r, c) = rows.at(r).at(c).get<double>();
    pose.translation[r] = rows.at(r).at(3).get<double>();
  }
  pose.rotation = Eigen::Quaterniond(rotation).normalized();
  return pose;
}

Camera camera_from(const json& j) {
  Camera c;
  c.width = j.at("width").get<int>();
  c.height = j.at("height").get<int>();
  c.fx = j.at("fx").get<double>();
  c.fy = j.at("fy").get<double>();
  c.cx = j.at("cx").get<double>();
  c.cy = j.at("cy").get<double>();
  c.k1 = j.value("k1", 0.0);
  c.k2 = j.value("k2", 0.0);
  c.p1 = j.value("p1", 0.0);
  c.p2 = j.value("p2", 0.0);
  c.k3 = j.value("k3", 0.0);
  return c;
}

TruthPass pass_from(const json& truth) {
  TruthPass pass;
  pass.camera = camera_from(truth.at("camera"));
  const json& frames = truth.at("frames");
  const double first_yaw = frames.at(0).value("subject_yaw_deg", 0.0);
  for (const json& frame : frames) {
    const double turned = (frame.value("subject_yaw_deg", 0.0) - first_yaw) * M_PI / 180.0;
    const Pose now_from_first{Eigen::Quaterniond(Eigen::AngleAxisd(turned, Eigen::Vector3d::UnitY())), {0, 0, 0}};
    pass.cam_from_world[frame.at("index").get<int>()] = pose_from(frame.at("cam_from_world")) * now_from_first;
    if (frame.value("blurred", false) || frame.value("defocused", false))
      pass.unsharp.insert(frame.at("index").get<int>());
  }
  for (const auto& [name, position] : frames.at(0).at("joints").items()) {
    const std::string vrm = vrm_joint_name(name);
    if (vrm.empty()) continue;
    pass.joints[vrm] = {position.at(0).get<double>(), position.at(1).get<double>(), position.at(2).get<double>()};
  }
  return pass;
}

Result<TruthPass> read_pass(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "truth.json";
  const auto text = read_file(file);
  if (!text) return tl::unexpected(text.error());
  TruthPass pass;
  try {
    const json truth = json::parse(*text);
    if (truth.value("format", "") != "synth-capture-1")
      return fail("not a truth file", file.string(), "its format must be synth-capture-1");
    pass = pass_from(truth);
  } catch (const json::exception& error) {
    return fail("cannot read truth", file.string(), error.what());
  }
  auto surface = read_ply(folder / "mesh.ply");
  if (!surface) return tl::unexpected(surface.error());
  if (surface->triangles.empty()) return fail("the true surface has no triangles", (folder / "mesh.ply").string());
  pass.surface = std::move(*surface);
  if (std::filesystem::exists(folder / "video.mp4")) pass.video = folder / "video.mp4";
  return pass;
}

}  // namespace

std::string vrm_joint_name(const std::string& mixamo) {
  static const std::map<std::string, std::string> centre = {{"Hips", "hips"},    {"Spine", "spine"},
                                                            {"Spine1", "chest"}, {"Spine2", "upperChest"},
                                                            {"Neck", "neck"},    {"Head", "head"}};
  static const std::map<std::string, std::string> sided = {
      {"Shoulder", "Shoulder"}, {"Arm", "UpperArm"}, {"ForeArm", "LowerArm"}, {"Hand", "Hand"},
      {"UpLeg", "UpperLeg"},    {"Leg", "LowerLeg"}, {"Foot", "Foot"},        {"ToeBase", "Toes"}};
  if (const auto found = centre.find(mixamo); found != centre.end()) return found->second;
  for (const auto& [theirs, ours] : {std::pair("Left", "left"), std::pair("Right", "right")}) {
    if (!mixamo.starts_with(theirs)) continue;
    const auto found = sided.find(mixamo.substr(std::string(theirs).size()));
    if (found != sided.end()) return ours + found->second;
  }
  return {};
}

Result<Truth> read_truth(const std::filesystem::path& subject_folder) {
  Truth truth;
  for (const auto& [folder, pass] : {std::pair("orbit-body", "body"), {"orbit-head", "head"}, {"turn", "turn"}}) {
    if (!std::filesystem::exists(subject_folder / folder)) continue;
    auto read = read_pass(subject_folder / folder);
    if (!read) return tl::unexpected(read.error());
    truth[pass] = std::move(*read);
  }
  if (truth.empty())
    return wrong_use("no truth found", subject_folder.string(),
                     "give the folder that holds orbit-body, orbit-head or turn");
  return truth;
}

}  // namespace gyre
