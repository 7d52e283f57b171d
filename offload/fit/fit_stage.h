// SPDX-License-Identifier: Apache-2.0
// Stage `fit`: the human template registered to the subject's cloud.
#pragma once

#include "common/bundle/stage.h"

namespace gyre {

// In: work/cloud/cloud.ply, work/cameras/scene.json. Out: posed.ply, rest.ply, fit.json.
Stage fit_stage();

}  // namespace gyre
