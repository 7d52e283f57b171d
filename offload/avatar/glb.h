// SPDX-License-Identifier: Apache-2.0
// glTF 2.0 binary files of an avatar, with the choices that every importer reads alike.
#pragma once

#include "offload/avatar/avatar.h"

#include <cstddef>
#include <vector>

namespace gyre {

// The bytes of a GLB: one skinned mesh with one primitive at the scene's root, one set of joints with float weights,
// dense morph targets with normals, their names in mesh.extras.targetNames, the texture embedded, and no animation,
// camera or sparse accessor, and tangents only with a normal map. Joint j is node j, the mesh the node after the last
// joint. `extensions`: what the asset's root says in extensions, by their names; the file does without where it is
// null. Equal avatars give equal bytes.
std::vector<std::byte> write_glb(const Avatar& avatar, const nlohmann::ordered_json& extensions = nullptr);

}  // namespace gyre
