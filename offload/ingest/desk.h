// SPDX-License-Identifier: Apache-2.0
// The host's side of every conversation with a device, without the sockets: who may say what, and the answers.
#pragma once

#include "common/wire/wire.h"
#include "offload/ingest/link_board.h"
#include "offload/ingest/receiver.h"
#include "offload/store/store.h"

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <string_view>

namespace gyre {

struct DeskOptions {
  std::uint64_t credit_bytes = 0;
  std::uint64_t max_file_bytes = 0;
  std::chrono::milliseconds silence_timeout{};
  std::uint64_t reserve_bytes = 0;  // no new scan is taken when less is left on the store's disk
};

// A peer is a connection (its routing id), a device is a CURVE key. A device has one conversation at a time: its last
// Hello ends the one before. Whoever breaks the rules is refused and has to start again.
class Desk {
 public:
  // send: hands a message to a peer; false when the peer has gone or does not read.
  using Send = std::function<bool(const std::string& peer, wire::Message message)>;
  // Whether a key is on the list of devices still.
  using IsAllowed = std::function<bool(const std::string& key)>;

  // board: is told who is there, and counts; outlives the desk. on_finished is called, from another thread, when
  // answer_finished() has something to do.
  Desk(
      DeskOptions options, Store& store, IsAllowed is_allowed, Send send,
      std::function<void(const std::string& scan_id)> on_queued, LinkBoard& board,
      std::function<void()> on_finished = [] {});

  // One message, as it came: key is the peer's authenticated public key, bytes what it sent.
  void receive(const std::string& peer, const std::string& key, std::string_view bytes);

  // Answers for files that are on disk, and for scans that are checked, by now.
  void answer_finished();
  // Waits until a scan's files that have come whole are on disk, and what is complete is checked, and answers for them.
  void settle(const std::string& scan_id);

  // Tells the scan's device, when it is there, and remembers for when it comes.
  void publish(const wire::StageProgress& progress);
  // The scan's job is done or failed; the store says which.
  void publish_end(const std::string& scan_id);

  // Ends conversations with devices that have not been heard of for the silence timeout, or are not on the list any
  // more.
  void forget_gone();

 private:
  struct Conversation {
    std::string key;
    std::string device_name;
    std::uint64_t spent = 0;      // credit for what was stored since the last grant
    std::set<std::string> scans;  // opened here, and therefore its own
    std::chrono::steady_clock::time_point last_heard;
    std::chrono::milliseconds deadline;  // gone when silent for longer
  };
  struct Handler;

  void greet(const std::string& peer, const std::string& key, const wire::Hello& hello);
  void open_scan(const std::string& peer, Conversation& device, const wire::ScanOpen& open);
  Result<std::optional<std::string>> no_place_for(const wire::ScanOpen& open) const;
  void take_chunk(const std::string& peer, Conversation& device, const wire::FileChunk& chunk);
  void close_scan(const std::string& peer, const wire::ScanClose& close);
  void send_result(const std::string& peer, const wire::ResultRequest& request);
  void send_end(const std::string& peer, const std::string& scan_id);
  void send(const std::string& peer, wire::Message message);
  void refuse(const std::string& peer, RefusalKind kind, const std::string& reason, bool permanent = true);
  void give_up(const std::string& peer, const Error& error);
  void handle(const std::string& peer, const std::string& key, std::string_view bytes);
  void say_finished();
  void settle_files(const std::string& scan_id);
  void remove_gone();
  std::string peer_of(const std::string& scan_id) const;

  DeskOptions options_;
  Store& store_;
  LinkBoard& board_;
  Receiver receiver_;
  IsAllowed is_allowed_;
  Send send_;
  std::function<void(const std::string&)> on_queued_;
  std::map<std::string, Conversation> conversations_;    // by peer
  std::map<std::string, std::string> peers_;             // by key
  std::map<std::string, wire::StageProgress> progress_;  // latest, of running jobs
  std::set<std::string> gone_;                           // peers whose conversation ends after this message
};

}  // namespace gyre
