// SPDX-License-Identifier: Apache-2.0
// The pipeline stage `texture`: keyframes, cameras and the fitted mesh in, albedo.png in the template's layout out.
#pragma once

#include "common/bundle/stage.h"

namespace gyre {

// Reads frames/, work/cameras and work/fit/posed.ply; writes albedo.png, source.png (which keyframe coloured which
// texel) and texture.json. Options: template (path, empty: where find_template looks), size (texels a side).
Stage texture_stage();

}  // namespace gyre
