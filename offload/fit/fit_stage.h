// SPDX-License-Identifier: Apache-2.0
// Stage `fit`: the human template registered to the subject's cloud.
#pragma once

#include "common/bundle/stage.h"

namespace gyre {

// In: work/cloud/cloud.ply, work/cameras/scene.json, work/landmarks/landmarks.json (where that stage has run). Out:
// posed.ply, rest.ply, fit.json (pose, shape, joints, measures with their deviations, regions that are the template's
// guess) and quality.json (residual_mm and confidence of each vertex of the two meshes).
Stage fit_stage();

}  // namespace gyre
