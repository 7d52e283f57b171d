// SPDX-License-Identifier: Apache-2.0
#include "device/uplink/monitor.h"

#include <zmq.hpp>

namespace gyre {

namespace {

constexpr int watched_events = ZMQ_EVENT_CONNECTED | ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_HANDSHAKE_FAILED_AUTH |
                               ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL | ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL |
                               ZMQ_EVENT_DISCONNECTED | ZMQ_EVENT_CLOSED;

}  // namespace

ConnectionMonitor::ConnectionMonitor(zmq::context_t& context, zmq::socket_t& socket)
    : monitor_(context, socket, watched_events) {}

std::optional<ConnectionEvent> ConnectionMonitor::next() {
  while (const std::optional<SocketEvent> event = monitor_.next()) {
    switch (event->code) {
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
  return std::nullopt;
}

}  // namespace gyre
