// SPDX-License-Identifier: Apache-2.0
#include "common/wire/pairing.h"

#include <zmq.hpp>

namespace gyre {

namespace {

// Strangers speak here: messages are small, few wait, and a connection that does not get going is closed.
constexpr std::int64_t max_message_bytes = 1024;
constexpr int mark = 16;
constexpr int handshake_timeout_ms = 5000;
constexpr int heartbeat_interval_ms = 2000;
constexpr int heartbeat_timeout_ms = 10000;
constexpr int last_words_ms = 1000;  // to get the end of a pairing out before the socket goes

}  // namespace

std::string pairing_data(const wire::PairRequest& request) {
  return "device " + request.public_key + " " + request.device_name;
}

std::string pairing_data(const wire::PairAnswer& answer) {
  return "host " + answer.public_key;
}

void configure_pairing_socket(zmq::socket_t& socket) {
  socket.set(zmq::sockopt::sndhwm, mark);
  socket.set(zmq::sockopt::rcvhwm, mark);
  socket.set(zmq::sockopt::maxmsgsize, max_message_bytes);
  socket.set(zmq::sockopt::handshake_ivl, handshake_timeout_ms);
  socket.set(zmq::sockopt::heartbeat_ivl, heartbeat_interval_ms);
  socket.set(zmq::sockopt::heartbeat_timeout, heartbeat_timeout_ms);
  socket.set(zmq::sockopt::linger, last_words_ms);
}

}  // namespace gyre
