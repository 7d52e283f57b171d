// SPDX-License-Identifier: Apache-2.0
// Who came to the host's socket and did not get as far as being heard; libzmq turns them away without a word.
#pragma once

#include "common/wire/socket_monitor.h"
#include "offload/ingest/link_board.h"

#include <chrono>
#include <cstdint>
#include <set>

namespace gyre {

class Door {
 public:
  // Watches `socket`, which must not be bound yet and must outlive this; so must counts.
  Door(zmq::context_t& context, zmq::socket_t& socket, LinkCounts& counts);

  zmq::socket_t& events() { return monitor_.events(); }

  // A message came over the connection with that descriptor.
  void heard(int descriptor) { heard_.insert(descriptor); }

  // Takes what has happened, and logs it: one line for all of a second, so that many strangers do not fill the log.
  void look();

 private:
  void say();

  void turn_away(std::uint64_t& kind);

  SocketMonitor monitor_;
  LinkCounts& counts_;
  std::set<int> heard_;          // descriptors of connections that are devices'
  bool is_turned_away_ = false;  // the connection that ends next has been counted
  std::uint64_t strangers_ = 0;  // not said yet
  std::uint64_t silent_ = 0;
  std::uint64_t ended_ = 0;
  std::chrono::steady_clock::time_point said_{};
};

}  // namespace gyre
