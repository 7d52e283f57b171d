// SPDX-License-Identifier: Apache-2.0
// The one place where the ZeroMQ sockets of the link get their options, and the CURVE keys of their two roles.
#pragma once

#include "common/keys/keys.h"

#include <string>

namespace zmq {
class message_t;
class socket_t;
}  // namespace zmq

namespace gyre {

// Options of the device's DEALER before it connects. One socket is one connection: libzmq must not reconnect it, since
// it would put messages meant for the last conversation at the start of the next.
void configure_device_socket(zmq::socket_t& socket, const KeyPair& keys, const std::string& host_public_key);

// Options of the host's ROUTER before it binds. A ZAP handler must already be bound: without one, libzmq lets every key
// in.
void configure_host_socket(zmq::socket_t& socket, const KeyPair& keys);

// A message of those bytes, not copied.
zmq::message_t message_of(std::string bytes);

}  // namespace gyre
