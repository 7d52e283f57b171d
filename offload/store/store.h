// SPDX-License-Identifier: Apache-2.0
// The host's store: a SQLite catalogue of scans, files, jobs and results, and the bundles themselves on disk.
#pragma once

#include "common/bundle/bundle.h"
#include "common/bundle/folder_lock.h"
#include "common/result/result.h"
#include "offload/store/scan_phase.h"

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace gyre {

class Database;

using WallTime = std::chrono::sys_time<std::chrono::milliseconds>;

inline WallTime wall_time_now() {
  return std::chrono::time_point_cast<std::chrono::milliseconds>(std::chrono::system_clock::now());
}

// No job is put back for longer; a wait that would last longer was written before the clock was set back, and is over.
constexpr std::chrono::milliseconds longest_retry_wait = std::chrono::minutes(10);

struct StoredFile {
  std::string name;  // relative to the bundle
  std::uint64_t size = 0;
  std::string sha256;
};

struct StoredScan {
  std::string id;
  std::string device_key;  // public key of the only device that may touch it
  std::string device_name;
  std::string created;  // as its scan.json says
  StorePhase phase = StorePhase::receiving;
  std::string reason;      // why the job failed
  bool delivered = false;  // the device has all results
  WallTime delivered_at{};
  bool operator==(const StoredScan&) const = default;
};

struct StoredJob {
  std::string scan;
  StorePhase phase = StorePhase::queued;
  std::string reason;   // of its last failure
  std::string options;  // of stages, a JSON object; what somebody asked for when it was run again
  int tries = 0;        // times it was taken since it was queued or asked for again
  WallTime not_before{};
  std::int64_t lease = 0;  // tells the holder of the job from those before
};

// What is left of a scan that was deleted: what it was made of, and nothing of what that showed.
struct DeletionReceipt {
  std::string scan;
  std::string at;  // ISO 8601, UTC
  std::string device_name;
  std::vector<StoredFile> files;  // all that were removed, derived ones included; relative to the store
};

// What may be deleted without being asked for. Nothing set: nothing.
struct RetentionPolicy {
  std::optional<std::chrono::hours> longest;  // since its results were delivered
  std::optional<std::size_t> most;            // delivered scans kept, the newest

  bool keeps_everything() const { return !longest && !most; }
};

// <folder>/catalogue.sqlite, <folder>/scans/<scan-id>/ (bundles), <folder>/incoming/<scan-id>/ (files half received).
// What a call has reported is on disk. All methods may be called from any thread; one process at a time owns a store.
class Store {
 public:
  // Opens or creates a store, brings an older catalogue up to date and checks it. Jobs that were running when the host
  // went down are queued again.
  static Result<std::unique_ptr<Store>> open(const std::filesystem::path& folder);
  ~Store();
  Store(const Store&) = delete;
  Store& operator=(const Store&) = delete;

  const std::filesystem::path& folder() const { return folder_; }
  Bundle bundle(std::string_view scan_id) const { return Bundle(folder_ / "scans" / scan_id); }
  std::filesystem::path incoming(std::string_view scan_id) const { return folder_ / "incoming" / scan_id; }

  // Registers a scan and creates its bundle folder. Again from the same device: fine. From another device: an error.
  Result<void> open_scan(const Scan& scan, const std::string& device_key, const std::string& device_name);
  Result<std::optional<StoredScan>> scan(const std::string& scan_id) const;
  Result<std::vector<StoredScan>> scans() const;  // oldest first

  // A file that lies synced in the bundle. Replaces an entry of the same name.
  Result<void> add_file(const std::string& scan_id, const StoredFile& file);
  Result<void> remove_file(const std::string& scan_id, const std::string& name);
  Result<std::optional<StoredFile>> file(const std::string& scan_id, const std::string& name) const;
  Result<std::vector<StoredFile>> files(const std::string& scan_id) const;  // by name

  // The rest are the events of scan_phase.h; one that may not happen in the scan's phase is an error.

  // The bundle is complete: its job is queued. A scan that has a job keeps it.
  Result<void> queue_job(const std::string& scan_id);
  // The oldest queued job that is due, of the device with the fewest in work; it runs until now + lease, or as long as
  // the lease is renewed. None of the scans in `except`. Nothing when there is none.
  Result<std::optional<StoredJob>> take_job(WallTime now = wall_time_now(),
                                            std::chrono::milliseconds lease = std::chrono::minutes(1),
                                            const std::vector<std::string>& except = {});
  // False: the job was taken away meanwhile.
  Result<bool> renew_lease(const std::string& scan_id, std::int64_t lease, WallTime until);
  // Queues the jobs again whose lease was not renewed in time, and names them.
  Result<std::vector<std::string>> take_back_lapsed(WallTime now);
  // A running job is queued again, to be tried once more from then on; within longest_retry_wait.
  Result<void> put_back_job(const std::string& scan_id, const std::string& reason, WallTime not_before);
  Result<std::vector<StoredJob>> jobs() const;  // of all scans, oldest first
  Result<void> finish_job(const std::string& scan_id, const std::vector<StoredFile>& results);
  // Of a scan that is still received: its files are no usable bundle. Else: its job failed or was cancelled.
  Result<void> fail_job(const std::string& scan_id, const std::string& reason);
  // A job that is done or failed is queued again. changes: to its options of stages, a merge patch (RFC 7396). Its
  // results stay until it has others.
  Result<void> retry_job(const std::string& scan_id, const std::string& changes = "{}");
  Result<std::vector<StoredFile>> results(const std::string& scan_id) const;  // by name
  Result<void> set_delivered(const std::string& scan_id, WallTime now = wall_time_now());

  // What is wrong with a scan: files and results that are missing or differ from their hash, one sentence each.
  Result<std::vector<std::string>> verify(const std::string& scan_id) const;

  // Removes everything of a scan: pictures, everything derived from them, and its entries. The id stays known as
  // deleted, so that its device does not bring it back. A crash in between is made good when the store is opened.
  // Error: its job is running.
  Result<DeletionReceipt> delete_scan(const std::string& scan_id);
  // Writes everything of a scan into one tar file. Error: its job is running.
  Result<void> export_scan(const std::string& scan_id, const std::filesystem::path& tar) const;
  // Takes a scan in from such a file, also one that was deleted here, and returns its id. Errors: the tar is not a
  // whole scan, or the store has it.
  Result<std::string> import_scan(const std::filesystem::path& tar);

  // Scans that the policy lets go, oldest first: of those only whose results are with their device.
  Result<std::vector<std::string>> expired(const RetentionPolicy& policy, WallTime now) const;

  // When the scan was deleted, or nothing.
  Result<std::optional<std::string>> deleted_at(const std::string& scan_id) const;

 private:
  Store(std::filesystem::path folder, FolderLock lock, std::unique_ptr<Database> database);
  Result<void> finish_deletions();
  Result<void> remove_folders(const std::string& scan_id) const;
  Result<StorePhase> step(const std::string& scan_id, ScanEvent event) const;
  Result<void> add_entry(const char* sql, const std::string& scan_id, const StoredFile& file) const;
  Result<std::vector<StoredFile>> entries(const char* sql, const std::string& scan_id) const;

  std::filesystem::path folder_;
  FolderLock lock_;
  mutable std::mutex mutex_;
  std::unique_ptr<Database> database_;
};

}  // namespace gyre
