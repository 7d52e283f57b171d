// SPDX-License-Identifier: Apache-2.0
// VRM 1.0 files of an avatar.
#pragma once

#include "offload/avatar/avatar.h"

#include <cstddef>
#include <string>
#include <vector>

namespace gyre {

// Who may do what with the avatar. Only what is always true of a scan of a person is written: the person alone uses it,
// not for profit, neither altered nor handed on.
struct VrmMeta {
  std::string name = "avatar";
  std::string author = "the person scanned";
};

// The bytes of a VRM: the avatar's GLB with the extension VRMC_vrm 1.0 (humanoid bones, look-at by the eye joints,
// first person, expression presets made of ARKit shapes and visemes, every shape as a custom expression under its own
// name). The avatar has to be bound in the VRM T-pose; `bones` names each of its joints as VRM does, "" for a joint
// that is no humanoid bone. Error when a required bone is missing.
Result<std::vector<std::byte>> write_vrm(const Avatar& avatar, const std::vector<std::string>& bones,
                                         const VrmMeta& meta = {});

}  // namespace gyre
