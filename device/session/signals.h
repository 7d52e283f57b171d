// SPDX-License-Identifier: Apache-2.0
// The one signal of every moment: guidance's while a pass is recorded, else what the rig is doing and waits for.
#pragma once

#include "device/guidance/guidance.h"
#include "device/session/session_state.h"

namespace gyre {

Signal signal_of(SessionState state, const Guidance& guidance);

}  // namespace gyre
