// SPDX-License-Identifier: Apache-2.0
// What a ZeroMQ connection goes through, in words; libzmq itself says nothing when a CURVE handshake fails.
#pragma once

#include <memory>
#include <optional>
#include <string>

namespace zmq {
class context_t;
class socket_t;
}  // namespace zmq

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
  ~ConnectionMonitor();
  ConnectionMonitor(const ConnectionMonitor&) = delete;
  ConnectionMonitor& operator=(const ConnectionMonitor&) = delete;

  zmq::socket_t& events() { return *events_; }  // readable when next() has something to say
  std::optional<ConnectionEvent> next();

 private:
  zmq::socket_t& watched_;
  std::unique_ptr<zmq::socket_t> events_;
};

}  // namespace gyre
