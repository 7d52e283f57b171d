// SPDX-License-Identifier: Apache-2.0
#include "common/wire/socket_monitor.h"

#include <atomic>
#include <cstring>
#include <string>
#include <zmq.hpp>

namespace gyre {

namespace {

std::string unique_address() {
  static std::atomic<int> count{0};
  return "inproc://socket-monitor-" + std::to_string(count++);
}

}  // namespace

SocketMonitor::SocketMonitor(zmq::context_t& context, zmq::socket_t& socket, int events) : watched_(socket) {
  const std::string address = unique_address();
  if (zmq_socket_monitor(socket.handle(), address.c_str(), events) != 0) throw zmq::error_t();
  events_ = std::make_unique<zmq::socket_t>(context, zmq::socket_type::pair);
  events_->set(zmq::sockopt::linger, 0);
  events_->set(zmq::sockopt::rcvhwm, 0);  // libzmq's own thread would wait for a reader that is behind
  events_->connect(address);
}

SocketMonitor::~SocketMonitor() {
  zmq_socket_monitor(watched_.handle(), nullptr, 0);
}

std::optional<SocketEvent> SocketMonitor::next() {
  while (true) {
    zmq::message_t event;
    if (!events_->recv(event, zmq::recv_flags::dontwait)) return std::nullopt;
    zmq::message_t address;
    if (event.more()) static_cast<void>(events_->recv(address));
    SocketEvent happened;  // two bytes and four of the first frame
    if (event.size() < sizeof happened.code + sizeof happened.value) continue;
    std::memcpy(&happened.code, event.data(), sizeof happened.code);
    std::memcpy(&happened.value, event.data<char>() + sizeof happened.code, sizeof happened.value);
    return happened;
  }
}

}  // namespace gyre
