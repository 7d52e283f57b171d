// SPDX-License-Identifier: Apache-2.0
// The stage `cloud`: work/cameras and frames/ in, cloud.ply, cloud.json and coverage.json out.
#pragma once

#include "common/bundle/stage.h"

namespace gyre {

Stage cloud_stage();

}  // namespace gyre
