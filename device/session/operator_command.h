// SPDX-License-Identifier: Apache-2.0
// What the operator asks for, with the button or on the page.
#pragma once

#include "device/session/session_state.h"

#include <optional>

namespace gyre {

struct OperatorCommand {
  enum class Kind {
    press,        // the button: starts, stops or acknowledges, whatever is next
    start,        // a pass
    stop,         // the pass
    cancel,       // what is being recorded; between passes: the passes that are still to come
    acknowledge,  // the avatar or the fault was seen
    shut_down,    // the device
  };
  Kind kind = Kind::press;
  std::optional<double> height_mm;  // of start: the subject's stature, for a scan that begins with it
};

// The event that a command is in a state.
SessionEvent event_of(OperatorCommand::Kind kind, SessionState state);

}  // namespace gyre
