// SPDX-License-Identifier: Apache-2.0
// What is exactly known about a rendered capture (format `synth-capture-1`).
#pragma once

#include "common/geometry/camera.h"
#include "common/geometry/pose.h"
#include "common/mesh/mesh.h"
#include "common/result/result.h"

#include <filesystem>
#include <map>
#include <set>
#include <string>

namespace gyre {

// One pass: its lens, the pose of every frame, and the subject as frame 0 shows it. Frames in which the subject is
// turned (pass `turn`) have the camera moved about the standing subject instead.
struct TruthPass {
  Camera camera;
  std::map<int, Pose> cam_from_world;             // by frame index
  std::set<int> unsharp;                          // frames with motion or focus blur
  std::filesystem::path video;                    // empty: none
  TriangleMesh surface;                           // the triangles seen in that pass, metres
  std::map<std::string, Eigen::Vector3d> joints;  // by VRM name, metres
};

// Passes by the name they have in a bundle: "body", "head", "turn".
using Truth = std::map<std::string, TruthPass>;

// Reads the passes that `subject_folder` holds: orbit-body as "body", orbit-head as "head", turn as "turn". Error when
// there is none, or one is damaged.
Result<Truth> read_truth(const std::filesystem::path& subject_folder);

// VRM 1.0 name of a joint named as in Mixamo skeletons ("LeftArm" is "leftUpperArm"); empty when it has none.
std::string vrm_joint_name(const std::string& mixamo);

}  // namespace gyre
