// SPDX-License-Identifier: Apache-2.0
#include "device/session/operator_command.h"

namespace gyre {

SessionEvent event_of(OperatorCommand::Kind kind, SessionState state) {
  using Kind = OperatorCommand::Kind;
  switch (kind) {
    case Kind::press:
      break;
    case Kind::start:
      return SessionEvent::start;
    case Kind::stop:
      return SessionEvent::stop;
    case Kind::cancel:
      return SessionEvent::cancel;
    case Kind::acknowledge:
      return SessionEvent::acknowledge;
    case Kind::shut_down:
      return SessionEvent::shut_down;
  }
  if (state == SessionState::arming || state == SessionState::pass) return SessionEvent::stop;
  if (state == SessionState::avatar_ready || state == SessionState::fault) return SessionEvent::acknowledge;
  return SessionEvent::start;
}

}  // namespace gyre
