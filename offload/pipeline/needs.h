// SPDX-License-Identifier: Apache-2.0
// What a stage takes for one scan, by the stage's own estimate.
#pragma once

#include "common/bundle/stage.h"

namespace gyre {

struct StageNeeds {
  bool parallel = true;
  double memory_gib = 1.0;
  double core_seconds = 60.0;
};

StageNeeds needs_of(const Stage& stage, const Bundle& bundle);

}  // namespace gyre
