// SPDX-License-Identifier: Apache-2.0
#include "device/uplink/monitor.h"

#include <atomic>
#include <cstdint>
#include <cstring>
#include <zmq.hpp>

namespace gyre {

namespace {

constexpr int watched_events = ZMQ_EVENT_CONNECTED | ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_HANDSHAKE_FAILED_AUTH |
                               ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL | ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL |
                               ZMQ_EVENT_DISCONNECTED | ZMQ_EVENT_CLOSED;

std::string unique_address() {
  static std::atomic<int> count{0};
  return "inproc://connection-monitor-" + std::to_string(count++);
}

}  // namespace

ConnectionMonitor::ConnectionMonitor(zmq::context_t& context, zmq::socket_t& socket) : watched_(socket) {
  const std::string address = unique_address();
  if (zmq_socket_monitor(socket.handle(), address.c_str(), watched_events) != 0) throw zmq::error_t();
  events_ = std::make_unique<zmq::socket_t>(context, zmq::socket_type::pair);
  events_->set(zmq::sockopt::linger, 0);
  events_->connect(address);
}

ConnectionMonitor::~ConnectionMonitor() {
  zmq_socket_monitor(watched_.handle(), nullptr, 0);
}

std::optional<ConnectionEvent> ConnectionMonitor::next() {
  while (true) {
    zmq::message_t event;
    if (!events_->recv(event, zmq::recv_flags::dontwait)) return std::nullopt;
    zmq::message_t address;
    if (event.more()) static_cast<void>(events_->recv(address));
    std::uint16_t code = 0;  // the first two bytes of the first frame, see zmq_socket_monitor(3)
    if (event.size() < sizeof code) continue;
    std::memcpy(&code, event.data(), sizeof code);
    switch (code) {
      case ZMQ_EVENT_CONNECTED:
        return ConnectionEvent::connected;
      case ZMQ_EVENT_HANDSHAKE_SUCCEEDED:
        return ConnectionEvent::secured;
      case ZMQ_EVENT_HANDSHAKE_FAILED_AUTH:
        return ConnectionEvent::unknown_key;
      case ZMQ_EVENT_MONITOR_STOPPED:
        break;
      default:
        return ConnectionEvent::lost;
    }
  }
}

}  // namespace gyre
