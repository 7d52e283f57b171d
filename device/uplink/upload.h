// SPDX-License-Identifier: Apache-2.0
// What one connection still has to send of the spool, and in which order.
#pragma once

#include "common/result/result.h"
#include "common/wire/wire.h"
#include "device/spool/spool.h"
#include "device/uplink/pacer.h"

#include <chrono>
#include <cstdint>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace gyre {

// Scans go oldest first. Of each: ScanOpen; once the host has told what it holds, discards and files by name; when
// everything is acknowledged and the scan is closed, ScanClose. What was sent but not acknowledged is forgotten with
// the connection: the next one asks the host. A scan the host refuses, as one without room does, is offered again after
// a while. Errors: the spool cannot be read or written.
class Upload {
 public:
  using Time = Pacer::Time;

  // limit: bytes a second at most, 0 for none. refused_retry: the while after which a refused scan is offered again.
  explicit Upload(Spool& spool, double limit = 0.0, std::chrono::milliseconds refused_retry = std::chrono::minutes(1))
      : spool_(spool), pacer_(limit), refused_retry_(refused_retry) {}

  // The spool may have changed.
  void refresh() { stale_ = true; }

  // The next message to send, if there is one and it is time for it.
  Result<std::optional<wire::Message>> next(Time now);

  // How long nothing but the limit keeps the next message back; zero when that does not.
  std::chrono::milliseconds wait(Time now) const;

  void on(const wire::Credit& credit, Time now) { pacer_.grant(credit.bytes, now); }
  Result<void> on(const wire::ScanState& state, Time now);
  Result<void> on(const wire::FileAck& ack);
  Result<void> on(const wire::FileResume& resume);

 private:
  // A scan on this connection.
  struct Scan {
    bool open_sent = false;
    bool host_known = false;  // its ScanState is here
    bool close_sent = false;
    bool over = false;                           // the host has it, failed it or refuses it
    std::set<std::string> at_host;               // names sent here, or held before
    std::map<std::string, std::string> sent;     // name to hash: sent whole here, not to be sent again
    std::map<std::string, wire::HeldFile> held;  // what the host has parts of, by name
    std::set<std::string> resumed;               // names the host asked for again: their hash is checked before
    int closes = 0;                              // times ScanClose was answered with "something is missing"
  };
  // The file being sent, open for reading.
  struct Current {
    std::string scan;
    SpooledFile file;
    std::ifstream content;
    std::uint64_t offset = 0;
  };

  Result<std::optional<wire::Message>> next_of(const std::string& id, Scan& scan);
  Result<std::optional<wire::Message>> next_chunk(Time now);
  Result<void> start(const std::string& id, Scan& scan, const SpooledFile& file);
  void offer_refused_again(Time now);
  Result<void> host_lacks_files(const SpooledScan& scan, const wire::ScanState& state);

  Spool& spool_;
  Pacer pacer_;
  std::chrono::milliseconds refused_retry_;
  std::map<std::string, Time> refused_;  // scan and when to offer it again
  bool stale_ = true;
  std::map<std::string, Scan> scans_;
  std::optional<Current> current_;
};

}  // namespace gyre
