// SPDX-License-Identifier: Apache-2.0
// The host's end of the link: lets known devices in, stores what they send, and sends progress and results back.
#pragma once

#include "common/keys/keys.h"
#include "common/result/result.h"
#include "offload/ingest/link_board.h"
#include "offload/store/store.h"

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

namespace gyre {

struct IngestOptions {
  std::string endpoint = "tcp://*:7410";  // port 0 or *: any free one, see IngestServer::endpoint
  KeyPair keys;                           // of this host
  std::filesystem::path allow_list;  // folder of the devices let in, see common/keys/keys.h; read at every handshake
  std::uint64_t credit_bytes = 4 << 20;  // what one device may have under way
  std::uint64_t max_file_bytes = 256 << 20;
  std::uint64_t reserve_bytes = 1 << 30;             // no new scan is taken when less is left on the store's disk
  std::chrono::milliseconds silence_timeout{60000};  // a device not heard of for that long is gone

  Result<void> check() const;
};

// Runs on threads of its own between start() and stop(). Everything it has acknowledged is in the store.
class IngestServer {
 public:
  // on_queued is called, from the server's thread, with every scan whose bundle is complete and whose job was queued
  // just now. It must return at once. Jobs queued earlier (before a restart) are found with Store::take_job.
  IngestServer(IngestOptions options, Store& store, std::function<void(const std::string& scan_id)> on_queued);
  ~IngestServer();  // stops
  IngestServer(const IngestServer&) = delete;
  IngestServer& operator=(const IngestServer&) = delete;

  // Binds the ZAP handler, then the socket, and serves.
  Result<void> start();
  void stop();
  std::string endpoint() const;    // with the real port, once started
  const LinkBoard& board() const;  // who is there, and what was counted; from any thread

  // The next three may be called from any thread, whether or not the device is connected; a device that comes back
  // later is told then.

  // Only the latest progress of a scan is kept and sent.
  void publish_progress(const std::string& scan_id, const std::string& stage, double fraction, const std::string& text);
  // The job is done: hashes the results in the bundle's root (avatar.glb, report.html, ...), records and offers them.
  Result<void> publish_result(const std::string& scan_id);
  // The job failed for good; reason is for the operator.
  Result<void> publish_failure(const std::string& scan_id, const std::string& reason);

 private:
  class Worker;
  std::unique_ptr<Worker> worker_;
};

}  // namespace gyre
