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

class SocketMonitor {
 public:
  // events: those wanted, ZMQ_EVENT_... `socket` must not be connected or bound yet and must outlive this.
  SocketMonitor(zmq::context_t& context, zmq::socket_t& socket, int events);
  ~SocketMonitor();
  SocketMonitor(const SocketMonitor&) = delete;
  SocketMonitor& operator=(const SocketMonitor&) = delete;

  zmq::socket_t& events() { return *events_; }  // readable when next() has something to say
  std::optional<std::uint16_t> next();          // ZMQ_EVENT_...

 private:
  zmq::socket_t& watched_;
  std::unique_ptr<zmq::socket_t> events_;
};

}  // namespace gyre
