// SPDX-License-Identifier: Apache-2.0
#include "offload/ingest/door.h"

#include <spdlog/spdlog.h>
#include <zmq.hpp>

namespace gyre {

namespace {

constexpr int watched_events =
    ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL | ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL | ZMQ_EVENT_DISCONNECTED;

}  // namespace

Door::Door(zmq::context_t& context, zmq::socket_t& socket, LinkCounts& counts)
    : monitor_(context, socket, watched_events), counts_(counts) {}

void Door::look() {
  while (const std::optional<std::uint16_t> event = monitor_.next()) {
    switch (*event) {
      case ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL:
        ++strangers_;
        ++counts_.failed_handshakes;
        break;
      case ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL:
        ++silent_;
        ++counts_.failed_handshakes;
        break;
      case ZMQ_EVENT_DISCONNECTED:
        ++ended_;
        break;
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
