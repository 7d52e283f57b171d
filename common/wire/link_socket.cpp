// SPDX-License-Identifier: Apache-2.0
#include "common/wire/link_socket.h"

#include "common/wire/wire.h"

#include <zmq.hpp>

namespace gyre {

namespace {

// More messages than credit lets a device have under way (4 MiB / wire::chunk_overhead) and than the host answers with:
// the high-water mark is never the thing that holds a peer back, because ROUTER drops what exceeds it.
constexpr int high_water_mark = 4096;

// Heartbeats find a peer that vanished without closing TCP (Wi-Fi, power) within ivl + timeout.
constexpr int heartbeat_interval_ms = 2000;
constexpr int heartbeat_timeout_ms = 10000;

// A TCP connection that has not finished the CURVE handshake by then is closed; a real device needs milliseconds.
constexpr int handshake_timeout_ms = 5000;

void configure(zmq::socket_t& socket, const KeyPair& keys) {
  socket.set(zmq::sockopt::sndhwm, high_water_mark);
  socket.set(zmq::sockopt::rcvhwm, high_water_mark);
  socket.set(zmq::sockopt::maxmsgsize, static_cast<int64_t>(wire::max_message_bytes));
  socket.set(zmq::sockopt::heartbeat_ivl, heartbeat_interval_ms);
  socket.set(zmq::sockopt::heartbeat_timeout, heartbeat_timeout_ms);
  socket.set(zmq::sockopt::heartbeat_ttl, heartbeat_timeout_ms);
  socket.set(zmq::sockopt::handshake_ivl, handshake_timeout_ms);
  socket.set(zmq::sockopt::linger, 0);  // what matters is repeated from disk, not from a queue
  socket.set(zmq::sockopt::curve_publickey, keys.public_key);
  socket.set(zmq::sockopt::curve_secretkey, keys.secret_key.reveal());
}

}  // namespace

void configure_device_socket(zmq::socket_t& socket, const KeyPair& keys, const std::string& host_public_key) {
  configure(socket, keys);
  socket.set(zmq::sockopt::curve_serverkey, host_public_key);
  socket.set(zmq::sockopt::reconnect_ivl, -1);
}

void configure_host_socket(zmq::socket_t& socket, const KeyPair& keys) {
  configure(socket, keys);
  socket.set(zmq::sockopt::curve_server, true);
  socket.set(zmq::sockopt::zap_domain, "gyre");
  socket.set(zmq::sockopt::router_mandatory, true);  // sending to a device that left is an error, not silence
}

}  // namespace gyre
