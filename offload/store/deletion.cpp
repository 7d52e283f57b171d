// SPDX-License-Identifier: Apache-2.0
// The parts of the store that look after what is on disk: whether scans are whole, and how they go.
#include "common/bundle/atomic_file.h"
#include "common/bundle/sha256.h"
#include "common/log/utc_time.h"
#include "offload/store/database.h"
#include "offload/store/store.h"

#include <spdlog/spdlog.h>
#include <algorithm>
#include <system_error>

namespace gyre {

namespace {

namespace fs = std::filesystem;

// Every file below `folder`, named relative to the store.
Result<std::vector<StoredFile>> files_below(const fs::path& folder, const fs::path& store) {
  std::vector<StoredFile> files;
  std::error_code error;
  if (!fs::exists(folder, error)) return files;
  for (auto it = fs::recursive_directory_iterator(folder, error); !error && it != fs::recursive_directory_iterator();
       it.increment(error)) {
    if (!it->is_regular_file(error)) continue;
    Result<std::string> hash = sha256_of_file(it->path());
    if (!hash) return tl::unexpected(hash.error());
    files.push_back({it->path().lexically_relative(store).generic_string(), it->file_size(error), std::move(*hash)});
  }
  if (error) return fail("cannot list", folder.string() + " (" + error.message() + ")");
  std::sort(files.begin(), files.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  return files;
}

}  // namespace

Result<std::vector<std::string>> Store::verify(const std::string& scan_id) const {
  Result<std::vector<StoredFile>> expected = files(scan_id);
  if (!expected) return tl::unexpected(expected.error());
  Result<std::vector<StoredFile>> derived = results(scan_id);
  if (!derived) return tl::unexpected(derived.error());
  expected->insert(expected->end(), derived->begin(), derived->end());
  std::vector<std::string> faults;
  for (const StoredFile& file : *expected) {
    const fs::path path = bundle(scan_id).root() / file.name;
    std::error_code error;
    const std::uintmax_t size = fs::file_size(path, error);
    if (error) {
      faults.push_back(file.name + " is missing");
    } else if (size != file.size) {
      faults.push_back(file.name + " has " + std::to_string(size) + " bytes instead of " + std::to_string(file.size));
    } else if (const Result<std::string> hash = sha256_of_file(path); !hash) {
      faults.push_back(file.name + " cannot be read");
    } else if (*hash != file.sha256) {
      faults.push_back(file.name + " differs from its hash");
    }
  }
  return faults;
}

Result<DeletionReceipt> Store::delete_scan(const std::string& scan_id) {
  const Result<std::optional<StoredScan>> known = scan(scan_id);
  if (!known) return tl::unexpected(known.error());
  if (!*known) return fail("no such scan in the store", scan_id, "`gyre-offload store list` names them");
  if ((*known)->phase == StorePhase::running) {
    return fail("the scan is being worked on", scan_id, "stop that first");
  }
  DeletionReceipt receipt{scan_id, utc_now(), (*known)->device_name, {}};
  for (const fs::path& folder : {bundle(scan_id).root(), incoming(scan_id)}) {
    Result<std::vector<StoredFile>> files = files_below(folder, folder_);
    if (!files) return tl::unexpected(files.error());
    receipt.files.insert(receipt.files.end(), files->begin(), files->end());
  }
  const std::lock_guard guard(mutex_);
  // Noted first: from here on it is finished, by the next start if need be.
  Database::Transaction transaction(*database_);
  if (Result<void> done = transaction.begin(); !done) return tl::unexpected(done.error());
  const Result<void> noted = run(*database_, "INSERT OR REPLACE INTO deleted (scan, at) VALUES (?, ?)",
                                 std::string_view(scan_id), std::string_view(receipt.at));
  if (!noted) return tl::unexpected(noted.error());
  const Result<void> removed = run(*database_, "DELETE FROM scans WHERE id = ?", std::string_view(scan_id));
  if (!removed) return tl::unexpected(removed.error());
  if (Result<void> done = transaction.commit(); !done) return tl::unexpected(done.error());
  if (Result<void> done = remove_folders(scan_id); !done) return tl::unexpected(done.error());
  // What the log of writes still holds of the scan goes too.
  if (Result<void> done = database_->execute("PRAGMA wal_checkpoint(TRUNCATE)"); !done) {
    return tl::unexpected(done.error());
  }
  return receipt;
}

Result<void> Store::remove_folders(const std::string& scan_id) const {
  std::error_code error;
  for (const fs::path& folder : {bundle(scan_id).root(), incoming(scan_id)}) {
    if (!fs::exists(folder, error)) continue;
    fs::remove_all(folder, error);
    if (error) {
      return fail("cannot delete", folder.string() + " (" + error.message() + ")",
                  "it is tried again at the next start");
    }
    if (Result<void> synced = sync_path(folder.parent_path()); !synced) return synced;
  }
  return {};
}

Result<void> Store::finish_deletions() {
  Result<Statement> statement = database_->prepare("SELECT scan FROM deleted");
  if (!statement) return tl::unexpected(statement.error());
  while (true) {
    const Result<bool> row = statement->step();
    if (!row) return tl::unexpected(row.error());
    if (!*row) return {};
    // A folder that cannot be removed must not keep the host from working.
    if (Result<void> done = remove_folders(statement->text(0)); !done) spdlog::error("{}", done.error().message());
  }
}

Result<std::optional<std::string>> Store::deleted_at(const std::string& scan_id) const {
  const std::lock_guard guard(mutex_);
  return first(*database_, "SELECT at FROM deleted WHERE scan = ?", std::string_view(scan_id));
}

}  // namespace gyre
