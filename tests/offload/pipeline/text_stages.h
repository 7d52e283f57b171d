// SPDX-License-Identifier: Apache-2.0
// A pipeline of two stages over text files: `double` writes its input twice, `shout` appends exclamation marks.
#pragma once

#include "common/bundle/stage.h"

#include <vector>

namespace gyre {

std::vector<Stage> text_stages();

}  // namespace gyre
