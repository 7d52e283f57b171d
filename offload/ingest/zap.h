// SPDX-License-Identifier: Apache-2.0
// The doorman: answers libzmq's question whether a CURVE key may connect (ZAP, rfc.zeromq.org/spec/27).
#pragma once

#include "common/wire/wakeup.h"
#include "offload/ingest/link_board.h"

#include <filesystem>
#include <thread>

namespace zmq {
class context_t;
class socket_t;
}  // namespace zmq

namespace gyre {

// Lets in the keys on the allow-list, which is read at every handshake, and logs every key it turns away. Messages of
// a device let in carry its public key as their User-Id. Must exist before a socket of `context` binds.
class ZapHandler {
 public:
  // counts: of who is turned away; outlives this.
  ZapHandler(zmq::context_t& context, std::filesystem::path allow_list, LinkCounts& counts);
  ~ZapHandler();
  ZapHandler(const ZapHandler&) = delete;
  ZapHandler& operator=(const ZapHandler&) = delete;

 private:
  void serve(zmq::socket_t socket);

  std::filesystem::path allow_list_;
  LinkCounts& counts_;
  Wakeup stop_;
  std::thread thread_;
};

}  // namespace gyre
