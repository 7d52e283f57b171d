// SPDX-License-Identifier: Apache-2.0
// The pipeline stage `avatar`: fitted shape and texture in, avatar.glb, avatar.vrm and avatar.fbx out.
#pragma once

#include "common/bundle/stage.h"

namespace gyre {

// Reads work/fit (rest.ply, fit.json), work/texture/albedo.png and work/cameras/scene.json; publishes avatar.glb and
// avatar.fbx in the template's rest pose, and avatar.vrm in the T-pose. Options: template (path, empty: where
// find_template looks), joint_names (vrm, mixamo or unreal), author (of the VRM's licence, empty: the person scanned),
// levels_of_detail (true: also work/avatar/avatar-50.glb and avatar-25.glb, of half and a quarter of the triangles).
Stage avatar_stage();

}  // namespace gyre
