// SPDX-License-Identifier: Apache-2.0
// The part of the store that moves scans out and in, and says which have been kept long enough.
#include "common/bundle/atomic_file.h"
#include "offload/store/database.h"
#include "offload/store/scan_archive.h"
#include "offload/store/store.h"

#include <algorithm>
#include <system_error>

namespace gyre {

namespace {

namespace fs = std::filesystem;

// A folder that goes with its owner unless it was moved away.
class Workplace {
 public:
  explicit Workplace(fs::path path) : path_(std::move(path)) {}
  Workplace(const Workplace&) = delete;
  Workplace& operator=(const Workplace&) = delete;
  ~Workplace() {
    std::error_code error;
    fs::remove_all(path_, error);
  }
  Result<void> clear() const {
    std::error_code error;
    fs::remove_all(path_, error);
    if (!error) fs::create_directories(path_, error);
    if (error) return fail("cannot create", path_.string() + " (" + error.message() + ")");
    return {};
  }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

}  // namespace

Result<void> Store::export_scan(const std::string& scan_id, const fs::path& tar) const {
  const Result<std::optional<StoredScan>> known = scan(scan_id);
  if (!known) return tl::unexpected(known.error());
  if (!*known) return fail("no such scan in the store", scan_id, "`gyre-offload store list` names them");
  if ((*known)->phase == StorePhase::running) return fail("the scan is being worked on", scan_id, "stop that first");
  Result<std::vector<StoredFile>> sent = files(scan_id);
  if (!sent) return tl::unexpected(sent.error());
  Result<std::vector<StoredFile>> made = results(scan_id);
  if (!made) return tl::unexpected(made.error());
  return pack_scan({**known, std::move(*sent), std::move(*made)}, bundle(scan_id), tar);
}

Result<std::string> Store::import_scan(const fs::path& tar) {
  const Workplace workplace(folder_ / "incoming" / ".import");
  if (Result<void> cleared = workplace.clear(); !cleared) return tl::unexpected(cleared.error());
  const Result<ArchivedScan> archived = unpack_scan(tar, workplace.path());
  if (!archived) return tl::unexpected(archived.error());
  const std::string& id = archived->scan.id;
  const Result<Scan> described = read_scan(Bundle(workplace.path()));
  if (!described) return tl::unexpected(described.error());
  if (described->id != id) return fail("the archive is not one of a scan", tar.string() + " (two ids)");

  const std::lock_guard guard(mutex_);
  const auto there = first(*database_, "SELECT id FROM scans WHERE id = ?", std::string_view(id));
  if (!there) return tl::unexpected(there.error());
  if (*there) return fail("the store has this scan", id, "delete it first");
  std::error_code error;
  fs::create_directories(workplace.path() / "frames", error);
  fs::remove_all(bundle(id).root(), error);  // not in the catalogue: of an import that a crash cut short
  if (Result<void> moved = rename_durably(workplace.path(), bundle(id).root()); !moved)
    return tl::unexpected(moved.error());
  Database::Transaction transaction(*database_);
  Result<void> done = transaction.begin();
  if (done) done = run(*database_, "DELETE FROM deleted WHERE scan = ?", std::string_view(id));
  if (done) {
    done = run(*database_,
               "INSERT INTO scans (id, device_key, device_name, created, delivered, delivered_at) "
               "VALUES (?, ?, ?, ?, ?, ?)",
               std::string_view(id), std::string_view(archived->scan.device_key),
               std::string_view(archived->scan.device_name), std::string_view(archived->scan.created),
               static_cast<std::int64_t>(archived->scan.delivered),
               static_cast<std::int64_t>(archived->scan.delivered ? wall_time_now().time_since_epoch().count() : 0));
  }
  for (std::size_t i = 0; done && i < archived->files.size(); ++i) {
    done = add_entry("INSERT INTO files (scan, name, size, sha256) VALUES (?, ?, ?, ?)", id, archived->files[i]);
  }
  for (std::size_t i = 0; done && i < archived->results.size(); ++i) {
    done = add_entry("INSERT INTO results (scan, name, size, sha256) VALUES (?, ?, ?, ?)", id, archived->results[i]);
  }
  const bool interrupted = archived->scan.phase == StorePhase::running;
  const StorePhase phase = interrupted ? StorePhase::queued : archived->scan.phase;
  if (done && phase != StorePhase::receiving) {
    done = run(*database_, "INSERT INTO jobs (scan, phase, reason) VALUES (?, ?, ?)", std::string_view(id),
               name_of(phase), std::string_view(archived->scan.reason));
  }
  if (done) done = transaction.commit();
  if (!done) return tl::unexpected(done.error());
  return id;
}

Result<std::vector<std::string>> Store::expired(const RetentionPolicy& policy, WallTime now) const {
  Result<std::vector<StoredScan>> all = scans();
  if (!all) return tl::unexpected(all.error());
  std::erase_if(*all, [](const StoredScan& s) { return s.phase != StorePhase::done || !s.delivered; });
  std::stable_sort(all->begin(), all->end(),
                   [](const StoredScan& a, const StoredScan& b) { return a.delivered_at < b.delivered_at; });
  const std::size_t beyond = policy.most && all->size() > *policy.most ? all->size() - *policy.most : 0;
  std::vector<std::string> ids;
  for (std::size_t i = 0; i < all->size(); ++i) {
    const StoredScan& one = (*all)[i];
    if (i < beyond || (policy.longest && now - one.delivered_at > *policy.longest)) ids.push_back(one.id);
  }
  return ids;
}

}  // namespace gyre
