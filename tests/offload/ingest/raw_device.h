// SPDX-License-Identifier: Apache-2.0
// A device that keeps to nothing, for tests of what the host does then.
#pragma once

#include "common/wire/link_socket.h"
#include "common/wire/wire.h"
#include "tests/offload/ingest/link_support.h"

#include <gtest/gtest.h>
#include <string>
#include <zmq.hpp>

namespace gyre {

// A device made by hand, which can say anything.
class RawDevice {
 public:
  RawDevice(const TestHost& host, const KeyPair& keys) : socket_(context_, zmq::socket_type::dealer) {
    configure_device_socket(socket_, keys, host.options().keys.public_key);
    socket_.set(zmq::sockopt::rcvtimeo, 20'000);
    socket_.connect(host.options().endpoint);
  }
  void say(const wire::Message& message) { say_bytes(wire::encode(message)); }
  void say_bytes(const std::string& bytes) { socket_.send(zmq::buffer(bytes), zmq::send_flags::none); }

  // The next message of that kind; others are passed over.
  template <class Kind>
  Kind hear() {
    zmq::message_t body;
    while (socket_.recv(body)) {
      const Result<wire::Message> message = wire::decode(body.to_string_view());
      if (!message) break;
      if (const auto* wanted = std::get_if<Kind>(&*message)) return *wanted;
    }
    ADD_FAILURE() << "the host did not answer";
    return {};
  }

 private:
  zmq::context_t context_;
  zmq::socket_t socket_;
};

}  // namespace gyre
