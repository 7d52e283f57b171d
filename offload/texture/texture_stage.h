// SPDX-License-Identifier: Apache-2.0
// The pipeline stage `texture`: keyframes, cameras and the fitted mesh in, albedo.png in the template's layout out.
#pragma once

#include "common/bundle/stage.h"

namespace gyre {

// Reads frames/, work/cameras and work/fit/posed.ply; writes, all of one size,
//   albedo.png      the texture, or albedo.jpg
//   source.png      which keyframe coloured which texel, in colours to look at
//   view.png        16-bit: 1 + index into `views` of texture.json, 0: none
//   origin.png      8-bit: how a texel got its colour, as TexelOrigin counts
//   confidence.png  8-bit: 255 for what the sharpest keyframes see head-on, 0 for what none saw
// and texture.json. Options: template (path, empty: where find_template looks), size (texels a side, 1024 to 8192),
// format ("png" or "jpeg": of the texture; a JPEG is a tenth as large), normal_map (also writes normal.png, the relief
// of work/cloud/cloud.ply, where there is a cloud).
Stage texture_stage();

}  // namespace gyre
