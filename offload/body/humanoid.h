// SPDX-License-Identifier: Apache-2.0
// The 55 humanoid bones of VRM 1.0 and the names of expressions: 52 of ARKit, 15 visemes.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace gyre {

struct HumanoidBone {
  std::string name;
  int parent = -1;  // index into the list, always smaller than the bone's own
};

// hips, spine, ..., rightLittleDistal: parents first.
const std::vector<HumanoidBone>& humanoid_bones();

// Index of a bone by name, -1: none.
int humanoid_bone(std::string_view name);

// "left..." and "right..." swapped (also "...Left" and "...Right"); other names unchanged.
std::string mirrored_name(std::string_view name);

// The blend shape locations of ARKit's face tracking, in alphabetical order.
const std::array<std::string_view, 52>& arkit_expressions();

// The visemes of Oculus LipSync in its order, named as avatars for the web name them: "viseme_sil", "viseme_PP", ...
const std::array<std::string_view, 15>& oculus_visemes();

}  // namespace gyre
