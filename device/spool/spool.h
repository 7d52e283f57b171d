// SPDX-License-Identifier: Apache-2.0
// The device's own memory of its scans: bundles on disk, and how far each file and each scan has got to the host.
#pragma once

#include "common/bundle/bundle.h"
#include "common/bundle/folder_lock.h"
#include "common/result/result.h"
#include "device/spool/spooled_scan.h"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace gyre {

// What went in since the spool was opened.
struct SpoolCounts {
  using Count = std::atomic<std::uint64_t>;
  Count frames{0}, bytes{0};
  Count discarded{0};  // keyframes that the selection took back
  Count no_room{0};    // times that the disk was too full
};

// What the host does not have yet.
struct SpoolWaiting {
  std::size_t scans = 0, files = 0;
  std::uint64_t bytes = 0;
};

// All scans of the device, each a bundle in <folder>/<scan-id>/ with a journal spool.jsonl in it. Survives a kill at
// any moment: a file or step whose call returned is there after a restart, one whose call did not return may be missing
// whole, never half. Nothing is deleted that the host has not acknowledged, except what the selection discarded; and of
// that only scans whose results are here, when a new one needs their room.
// All methods may be called from any thread. Every error leaves the scan as it was.
class Spool {
 public:
  // So much room stays free on the disk: for the end of a scan, for results, and for everybody else.
  static constexpr std::uint64_t usual_reserve = 256 << 20;

  // Opens or creates the folder, locks it against a second process and puts right what a crash left behind.
  static Result<std::unique_ptr<Spool>> open(const std::filesystem::path& folder,
                                             std::uint64_t reserve_bytes = usual_reserve);
  ~Spool();
  Spool(const Spool&) = delete;
  Spool& operator=(const Spool&) = delete;

  // --- For the session, which records.

  // Starts a scan (scan.id: a new ULID), or does nothing when it is already being recorded (after a restart).
  Result<void> open_scan(const Scan& scan);

  // Stores one file of a scan being recorded; from now on the uplink may send it. name: "frames/" + frame_name(...).
  // The same bytes again are fine and do nothing; other bytes replace the file. When the room on the disk comes to an
  // end, scans whose results are here make room, the oldest first; when there are none left it is an error that says
  // so, with room enough to close the scan with what it has.
  Result<void> add_file(const std::string& scan_id, const std::string& name, std::span<const std::byte> bytes);

  // Takes back a candidate that the exact selection dropped. An unknown name is fine.
  Result<void> discard(const std::string& scan_id, const std::string& name);

  // Writes the final scan.json and frames.jsonl and closes the scan: its bundle is what was added and not discarded.
  // The keyframes in `records` must be exactly those files. Closing a closed scan is fine and does nothing.
  Result<void> close_scan(const Scan& scan, const std::vector<FrameRecord>& records);

  // --- For everyone.

  Bundle bundle(const std::string& scan_id) const { return Bundle(folder_ / scan_id); }
  std::optional<SpooledScan> scan(const std::string& scan_id) const;
  std::vector<std::string> scan_ids() const;  // oldest first
  std::optional<SpoolPhase> phase(const std::string& scan_id) const;
  const std::filesystem::path& folder() const { return folder_; }
  const SpoolCounts& counts() const { return counts_; }
  SpoolWaiting waiting() const;

  // How much may still be added, bytes: what is free above the reserve, and what older scans would make room for.
  // Error: the disk cannot be asked.
  Result<std::uint64_t> room() const;

  // Deletes a scan the host has whole (acknowledged, delivered or failed); any other is refused.
  Result<void> remove_scan(const std::string& scan_id);

  // --- For the uplink.

  // Called, from the thread that made it, after every change of the recording side. One listener; empty: none, and on
  // return the old one is not running any more. It must not call the spool.
  void on_change(std::function<void()> listener);

  // The host has synced this very content to its disk.
  Result<void> acknowledge_file(const std::string& scan_id, const std::string& name, const std::string& sha256);
  // The host has lost it, or never had it: send it again.
  Result<void> unacknowledge_file(const std::string& scan_id, const std::string& name);
  // The host has the whole bundle.
  Result<void> acknowledge_scan(const std::string& scan_id);
  // The reconstruction failed; `reason` is for the operator.
  Result<void> fail_scan(const std::string& scan_id, const std::string& reason);
  // `from`, a complete file with that hash on the same file system, becomes <scan>/<name>.
  Result<void> add_result(const std::string& scan_id, const SpooledFile& result, const std::filesystem::path& from);
  // All results are here.
  Result<void> deliver_scan(const std::string& scan_id);

 private:
  struct Entry;
  Spool(std::filesystem::path folder, FolderLock lock, std::uint64_t reserve_bytes);
  std::filesystem::path journal_file(const std::string& scan_id) const;
  Result<void> load(const std::string& scan_id);
  Result<void> repair(Entry& entry);
  Result<Entry*> find(const std::string& scan_id) const;
  Result<void> record(const std::string& scan_id, const SpoolEvent& event);
  Result<void> make_room(std::uint64_t bytes);
  Result<void> erase(const std::string& scan_id);
  void notify() const;

  std::filesystem::path folder_;
  FolderLock lock_;
  std::uint64_t reserve_bytes_;
  SpoolCounts counts_;
  mutable std::mutex mutex_;
  std::map<std::string, std::unique_ptr<Entry>> scans_;
  mutable std::mutex listener_mutex_;
  std::function<void()> listener_;
};

}  // namespace gyre
