// SPDX-License-Identifier: Apache-2.0
// What libzmq does with a socket's connections, as it happens (zmq_socket_monitor(3)).
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

namespace zmq {
class context_t;
class socket_t;
}  // namespace zmq

namespace gyre {

struct SocketEvent {
  std::uint16_t code = 0;  // ZMQ_EVENT_...
  std::int32_t value = 0;  // of a connection made or lost: its descriptor
};

class SocketMonitor {
 public:
  // events: those wanted, ZMQ_EVENT_... `socket` must not be connected or bound yet and must outlive this.
  SocketMonitor(zmq::context_t& context, zmq::socket_t& socket, int events);
  ~SocketMonitor();
  SocketMonitor(const SocketMonitor&) = delete;
  SocketMonitor& operator=(const SocketMonitor&) = delete;

  zmq::socket_t& events() { return *events_; }  // readable when next() has something to say
  std::optional<SocketEvent> next();

 private:
  zmq::socket_t& watched_;
  std::unique_ptr<zmq::socket_t> events_;
};

}  // namespace gyre
