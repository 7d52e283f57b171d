// SPDX-License-Identifier: Apache-2.0
// The 55 humanoid bones of VRM 1.0 and the 52 ARKit expression names, in Gyre's order.
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

}  // namespace gyre
