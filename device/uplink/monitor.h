// SPDX-License-Identifier: Apache-2.0
// What a ZeroMQ connection goes through, in words; libzmq itself says nothing when a CURVE handshake fails.
#pragma once

#include "common/wire/socket_monitor.h"

#include <optional>

namespace gyre {

enum class ConnectionEvent {
  connected,    // TCP is there, CURVE is not yet
  secured,      // both ends know each other
  unknown_key,  // the host refuses our key
  lost,         // no TCP connection, or none any more
};

class ConnectionMonitor {
 public:
  // Watches `socket`, which must not be connected yet and must outlive this.
  ConnectionMonitor(zmq::context_t& context, zmq::socket_t& socket);

  zmq::socket_t& events() { return monitor_.events(); }  // readable when next() has something to say
  std::optional<ConnectionEvent> next();

 private:
  SocketMonitor monitor_;
};

}  // namespace gyre
