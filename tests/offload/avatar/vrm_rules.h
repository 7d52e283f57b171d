// SPDX-License-Identifier: Apache-2.0
// What the VRM 1.0 specification asks of a file, as far as its JSON shows it.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace gyre {

// Faults of a glTF document (its JSON chunk) as a VRM 1.0, a sentence each; none when it keeps the rules of
// VRMC_vrm-1.0: required and known properties with their types and values, bones that exist once, required ones
// present, each below the parent that the humanoid's tree gives it, nodes with positive uniform scales, binds that
// exist; and what the specification asks of the rest: no animations, cameras or tangents.
std::vector<std::string> vrm_faults(const nlohmann::json& gltf);

}  // namespace gyre
