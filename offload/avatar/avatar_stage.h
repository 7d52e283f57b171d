// SPDX-License-Identifier: Apache-2.0
// The pipeline stage `avatar`: fitted shape and texture in, avatar.glb out.
#pragma once

#include "common/bundle/stage.h"

namespace gyre {

// Reads work/fit (rest.ply, fit.json), work/texture/albedo.png and work/cameras/scene.json; writes avatar.glb, which is
// published. Option: template (path, empty: where find_template looks).
Stage avatar_stage();

}  // namespace gyre
