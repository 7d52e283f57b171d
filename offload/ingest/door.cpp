// SPDX-License-Identifier: Apache-2.0
#include "offload/ingest/door.h"

#include <spdlog/spdlog.h>
#include <utility>
#include <zmq.hpp>

namespace gyre {

namespace {

constexpr int watched_events = ZMQ_EVENT_HANDSHAKE_FAILED_AUTH | ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL |
                               ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL | ZMQ_EVENT_DISCONNECTED;

}  // namespace

Door::Door(zmq::context_t& context, zmq::socket_t& socket, LinkCounts& counts)
    : monitor_(context, socket, watched_events), counts_(counts) {}

void Door::turn_away(std::uint64_t& kind) {
  ++kind;
  ++counts_.failed_handshakes;
}

void Door::look() {
  while (const std::optional<SocketEvent> event = monitor_.next()) {
    switch (event->code) {
      case ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL:
        turn_away(strangers_);
        is_turned_away_ = true;
        break;
      case ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL:
        turn_away(silent_);
        is_turned_away_ = true;
        break;
      case ZMQ_EVENT_HANDSHAKE_FAILED_AUTH:  // the doorman has logged it
        is_turned_away_ = true;
        break;
      case ZMQ_EVENT_DISCONNECTED: {
        // libzmq does not say why it hangs up on one that speaks another protocol altogether.
        const bool was_heard = heard_.erase(event->value) > 0;
        if (std::exchange(is_turned_away_, false)) break;
        if (was_heard) {
          ++ended_;
        } else {
          turn_away(strangers_);
        }
        break;
      }
      default:
        break;
    }
  }
  say();
}

void Door::say() {
  constexpr std::chrono::seconds between{1};
  const auto now = std::chrono::steady_clock::now();
  if (strangers_ + silent_ + ended_ == 0 || now - said_ < between) return;
  said_ = now;
  if (strangers_ > 0)
    spdlog::warn("turned away {} connection(s) that do not speak as a paired device does", strangers_);
  if (silent_ > 0) spdlog::warn("turned away {} connection(s) that did not say who they are in time", silent_);
  if (ended_ > 0) spdlog::info("{} connection(s) ended", ended_);
  strangers_ = silent_ = ended_ = 0;
}

}  // namespace gyre
