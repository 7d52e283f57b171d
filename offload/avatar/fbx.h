// SPDX-License-Identifier: Apache-2.0
// Binary FBX 7.4 files of an avatar.
#pragma once

#include "offload/avatar/avatar.h"

#include <cstddef>
#include <vector>

namespace gyre {

// The bytes of an FBX: centimetres, +Y up, facing +Z; one mesh with texture coordinates for each corner (vertices split
// at texture seams are one again), a skin of one cluster a joint, a bind pose, a blend shape channel an expression with
// full lists of vertices and full weights as doubles, one material, and the texture embedded. Equal avatars give equal
// bytes.
std::vector<std::byte> write_fbx(const Avatar& avatar);

}  // namespace gyre
