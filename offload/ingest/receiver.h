// SPDX-License-Identifier: Apache-2.0
// What the host does with what a device sends, between the socket and the store.
#pragma once

#include "common/result/result.h"
#include "common/wire/wire.h"
#include "offload/ingest/batch_worker.h"
#include "offload/ingest/finish_files.h"
#include "offload/ingest/link_board.h"
#include "offload/ingest/part_files.h"
#include "offload/store/store.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace gyre {

// Files arrive in <store>/incoming/<scan-id>/ under a name made of theirs and their hash, so that what was received is
// known after any restart from the disk alone; a complete one is checked, synced, moved into the bundle and catalogued,
// and only then acknowledged; that takes place on another thread, and finished() hands out its outcome. An error means
// that the store cannot go on (a full disk), not that the peer is at fault. Callers have made sure that the scan is
// open and belongs to the device.
class Receiver {
 public:
  // on_finished is called, from another thread, when finished() has something.
  Receiver(
      Store& store, std::uint64_t max_file_bytes, LinkCounts& counts, std::function<void()> on_finished = [] {});

  // What the host has of a scan. Files that vanished from the disk are taken out of the catalogue first.
  Result<wire::ScanState> state(const std::string& scan_id);

  // Stores a chunk. Returns the answer when there is one already: FileAck when the file is here, FileResume, or
  // ScanState when the scan takes no files.
  Result<std::optional<wire::Message>> accept(const wire::FileChunk& chunk);

  struct Finished {
    std::string scan;
    Result<wire::Message> answer;  // FileAck; FileResume when a file was damaged; ScanState of a scan that was checked
    bool queued = false;           // the scan's job is new
  };
  // What has become of files and scans that had come whole, since the last call.
  std::vector<Finished> finished();
  // Until there is an outcome of every file of that scan.
  void wait_for(const std::string& scan_id);
  // Until there is an outcome of every scan that has come whole.
  void wait_for_checks() { checker_.wait(); }

  // The rest is to be called when there is nothing to wait for of that scan.

  // Forgets a candidate while the scan is still receiving and not being checked.
  Result<void> discard(const wire::Discard& discard);

  // Compares the scan with its manifest. When files lack, returns the scan's state. When all is here, removes what is
  // not in it and has the bundle verified; finished() tells when its job is queued, or the scan has failed.
  Result<std::optional<wire::ScanState>> close(const wire::ScanClose& manifest);

  // To be called now and then: gives back what files hold that were removed while they were received.
  void tidy() { parts_.close_removed(); }

 private:
  struct CheckedBundle {
    std::string scan;
    Result<void> good;
  };
  Result<std::optional<wire::Message>> answer_unwritten(const wire::FileChunk& chunk, bool& wanted);
  std::filesystem::path part_of(const std::string& scan_id, const std::string& name, const std::string& sha256) const;
  Result<void> remove_unlisted(const wire::ScanClose& manifest);
  Finished conclude(const CheckedBundle& checked);

  Store& store_;
  std::uint64_t max_file_bytes_;
  LinkCounts& counts_;
  std::set<std::filesystem::path> finishing_;  // parts that are the finisher's
  std::set<std::filesystem::path> resuming_;   // parts whose sender was asked to resume and has not yet
  std::set<std::string> checking_;             // scans that are the checker's
  PartFiles parts_;
  BatchWorker<ArrivedFile, FinishedFile> finisher_;
  BatchWorker<std::string, CheckedBundle> checker_;  // one scan at a time: every keyframe of it is decoded
};

}  // namespace gyre
