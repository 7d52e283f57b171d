// SPDX-License-Identifier: Apache-2.0
#include "common/wire/link_socket.h"

#include "common/wire/wire.h"

#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>
#include <zmq.hpp>

namespace gyre {

namespace {

// High-water marks count messages. What waits to be sent is bounded by credit (4 MiB / wire::chunk_overhead messages)
// and by what a peer asks for, so sending never reaches its mark unless the peer does not read: then ROUTER refuses,
// and the conversation ends. What the host has received and not looked at is bounded by a small mark, against a device
// that sends regardless of credit: libzmq stops reading from it, and loses nothing.
constexpr int send_mark = 4096;
constexpr int device_receive_mark = 1024;
constexpr int host_receive_mark = 64;

// A message somewhat larger than allowed is still read, so that its sender can be told; a larger one ends the
// connection.
constexpr std::int64_t most_bytes = 2 * static_cast<std::int64_t>(wire::max_message_bytes);

// Heartbeats find a peer that vanished without closing TCP (Wi-Fi, power) within ivl + timeout.
constexpr int heartbeat_interval_ms = 2000;
constexpr int heartbeat_timeout_ms = 10000;

// Connections that may wait to be accepted: enough that many strangers at once do not keep a device out for long.
constexpr int waiting_connections = 1024;

// A TCP connection that has not finished the CURVE handshake by then is closed; a real device needs milliseconds.
constexpr int handshake_timeout_ms = 5000;

void configure(zmq::socket_t& socket, const KeyPair& keys, int receive_mark) {
  socket.set(zmq::sockopt::sndhwm, send_mark);
  socket.set(zmq::sockopt::rcvhwm, receive_mark);
  socket.set(zmq::sockopt::maxmsgsize, most_bytes);
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
  configure(socket, keys, device_receive_mark);
  socket.set(zmq::sockopt::curve_serverkey, host_public_key);
  socket.set(zmq::sockopt::reconnect_ivl, -1);
}

void configure_host_socket(zmq::socket_t& socket, const KeyPair& keys) {
  configure(socket, keys, host_receive_mark);
  socket.set(zmq::sockopt::curve_server, true);
  socket.set(zmq::sockopt::zap_domain, "gyre");
  socket.set(zmq::sockopt::backlog, waiting_connections);
  socket.set(zmq::sockopt::router_mandatory, true);  // sending to a device that left is an error, not silence
}

namespace {

// Bytes that libzmq's thread frees. It hands them over by means of its own, of which the thread sanitizer sees nothing:
// the mark says the same in its words.
struct HandedOver {
  std::string bytes;
  std::atomic<bool> complete{false};
};

}  // namespace

zmq::message_t message_of(std::string bytes) {
  auto owner = std::make_unique<HandedOver>();
  owner->bytes = std::move(bytes);
  const auto free = [](void*, void* hint) {
    const std::unique_ptr<HandedOver> last(static_cast<HandedOver*>(hint));
    static_cast<void>(last->complete.load(std::memory_order_acquire));
  };
  owner->complete.store(true, std::memory_order_release);
  zmq::message_t message(owner->bytes.data(), owner->bytes.size(), free, owner.get());
  static_cast<void>(owner.release());  // libzmq's now
  return message;
}

}  // namespace gyre
