// SPDX-License-Identifier: Apache-2.0
// The stages of the orbit pipeline, in order.
#pragma once

#include "common/bundle/stage.h"

#include <vector>

namespace gyre {

std::vector<Stage> orbit_stages();

}  // namespace gyre
