// SPDX-License-Identifier: Apache-2.0
// One connection to the host, from Hello to its end.
#pragma once

#include "common/wire/wakeup.h"
#include "common/wire/wire.h"
#include "device/spool/spool.h"
#include "device/uplink/download.h"
#include "device/uplink/monitor.h"
#include "device/uplink/notices.h"
#include "device/uplink/uplink.h"
#include "device/uplink/upload.h"

#include <atomic>
#include <chrono>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <string>

namespace gyre {

// Why a conversation is over.
struct Ending {
  enum class Kind { stopped, unreachable, refused, again };  // again: try at once, nothing is wrong
  Kind kind = Kind::unreachable;
  std::string text;
};

// What a conversation tells its owner while it lasts; called on the thread that holds it.
struct ConversationEvents {
  std::function<void()> connected;
  std::function<void()> changed;  // a scan of the spool is in another state
  std::function<void(const std::string& scan_id, const std::string& reason)> scan_refused;  // empty: taken
  std::function<void(const wire::StageProgress& progress)> progress;
};

class Conversation {
 public:
  Conversation(zmq::context_t& context, const UplinkOptions& options, Spool& spool, Notices& notices,
               UplinkCounts& counts, ConversationEvents events);

  // Holds it until it is over or `stop` is set; `wakeup` is notified when that or the spool has changed.
  Ending hold(Wakeup& wakeup, const std::atomic<bool>& stop);

 private:
  using Clock = std::chrono::steady_clock;
  struct Handler;

  Ending converse(Wakeup& wakeup, const std::atomic<bool>& stop);
  std::optional<Ending> exchange();
  std::optional<Ending> read_events();
  std::optional<Ending> read_messages();
  std::optional<Ending> write_messages();
  std::optional<Ending> check_time();
  Result<void> on_offer(const wire::ResultOffer& offer);
  Result<void> on_chunk(const wire::ResultChunk& chunk);
  Result<void> send(wire::Message message);
  Result<std::optional<wire::Message>> next_message();
  Result<void> on_welcome(const wire::Welcome& welcome);
  Ending unreachable(const std::string& why) const;

  const UplinkOptions& options_;
  Spool& spool_;
  Notices& notices_;
  UplinkCounts& counts_;
  ConversationEvents events_;
  std::unique_ptr<zmq::socket_t> socket_;
  std::unique_ptr<ConnectionMonitor> monitor_;
  Upload upload_;
  std::list<Download> downloads_;
  bool secured_ = false;
  bool greeted_ = false;
  bool more_to_write_ = false;
  std::chrono::milliseconds ping_interval_;
  Clock::time_point started_;
  Clock::time_point last_heard_;
  Clock::time_point last_sent_;
  Clock::time_point last_ping_;
};

}  // namespace gyre
