// SPDX-License-Identifier: Apache-2.0
// Carries the scans of the spool to the host and brings the results back, for as long as it lives.
#pragma once

#include "common/keys/keys.h"
#include "common/result/result.h"
#include "common/wire/wire.h"
#include "device/spool/spool.h"

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <string>

namespace gyre {

struct UplinkOptions {
  std::string host;             // endpoint, "tcp://workstation:7410"
  std::string host_public_key;  // Z85
  KeyPair keys;                 // of this device
  std::string device_name;
  double limit_bytes_per_s = 0.0;                    // for what goes up; 0: none
  std::chrono::milliseconds hello_timeout{5000};     // from connecting to the host's welcome
  std::chrono::milliseconds ping_interval{2000};     // a question after that much silence
  std::chrono::milliseconds silence_timeout{20000};  // then the connection counts as dead
  std::chrono::milliseconds reconnect_min{100};      // wait before trying again, doubled every time,
  std::chrono::milliseconds reconnect_max{5000};     // up to this
  std::chrono::milliseconds refused_retry{60000};    // until a scan that the host refused is offered again

  Result<void> check() const;
};

struct LinkStatus {
  enum class Phase { connecting, connected, unreachable, refused };
  Phase phase = Phase::connecting;
  std::string text;  // one line for the operator
};

// Since the uplink was made.
struct UplinkCounts {
  using Count = std::atomic<std::uint64_t>;
  Count connections{0};         // times the host welcomed this device
  Count lost{0};                // connections that ended or did not come about
  Count refused{0};             // by the host
  Count bytes{0};               // of files, those sent again included
  Count acknowledged_files{0};  // the host has them
  Count resumed_files{0};       // the host asked for again
  Count result_bytes{0};        // received
};

// How far the host is with a scan.
struct ScanProgress {
  std::string stage;  // "upload", "queued", or a pipeline stage
  double fraction = 0.0;
  std::string text;
};

struct ResultWait {
  std::chrono::milliseconds unreachable{60'000};  // give up after that long without a connection
  std::chrono::milliseconds total{7'200'000};     // give up after that long in any case
};

// Starts working when constructed, on a thread of its own: follows the spool, sends every file that is not acknowledged
// (recording or closed), announces discards and closed scans, fetches results, reconnects for ever. The spool outlives
// it.
class Uplink {
 public:
  // options.check() must hold.
  Uplink(UplinkOptions options, Spool& spool);
  ~Uplink();  // stops at once; everything continues with the next Uplink on the same spool
  Uplink(const Uplink&) = delete;
  Uplink& operator=(const Uplink&) = delete;

  LinkStatus status() const;
  const UplinkCounts& counts() const;

  // What the device does, for those who look at the host: a word ("ready", "recording"), a sentence that may be empty,
  // and the scan it records (empty: none). Only the latest is sent, before anything large.
  void tell(const std::string& state, const std::string& text, const std::string& scan_id);
  // What the scan being recorded has seen; only the latest is sent, a few times a second at most.
  void tell(wire::CoveragePreview preview);

  // How far a closed scan is; stage "refused" when the host does not take it, with the reason.
  ScanProgress progress(const std::string& scan_id) const;

  // Blocks until the results of a closed scan lie in its folder (avatar.glb and what else the host offered).
  // progress, if given, is called from this thread on every change. Errors: the host refuses or does not answer (the
  // scan stays in the spool and goes on with the next Uplink), or the reconstruction failed.
  Result<void> wait_for_result(const std::string& scan_id, const ResultWait& wait,
                               const std::function<void(const ScanProgress&)>& progress = {});

 private:
  class Worker;
  std::unique_ptr<Worker> worker_;
};

}  // namespace gyre
