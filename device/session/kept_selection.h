// SPDX-License-Identifier: Apache-2.0
// The exact rule for a camera whose frames cannot be had again: among those that were kept.
#pragma once

#include "common/selection/selection.h"

#include <functional>
#include <span>

namespace gyre {

// As select_keyframes, with the movement of all frames; each keyframe is the sharpest kept frame of its neighbourhood,
// and where none was kept there the nearest one between the keyframes beside it, if there is any. is_kept: by index.
// Errors: those of select_keyframes, and when nothing was kept.
Result<Selection> select_among_kept(std::span<const FrameMeasure> frames, const std::function<bool(int)>& is_kept,
                                    const SelectionOptions& options);

}  // namespace gyre
