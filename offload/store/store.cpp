// SPDX-License-Identifier: Apache-2.0
#include "offload/store/store.h"

#include "common/bundle/atomic_file.h"
#include "common/bundle/ulid.h"
#include "offload/store/database.h"

#include <array>
#include <system_error>

namespace gyre {

namespace {

namespace fs = std::filesystem;

// Step n brings a catalogue of version n to version n + 1 (PRAGMA user_version).
constexpr std::array<const char*, 3> migrations = {R"(
CREATE TABLE scans (
  id TEXT PRIMARY KEY,
  device_key TEXT NOT NULL,
  device_name TEXT NOT NULL,
  created TEXT NOT NULL,
  delivered INTEGER NOT NULL DEFAULT 0
) STRICT;
CREATE TABLE files (
  scan TEXT NOT NULL REFERENCES scans(id) ON DELETE CASCADE,
  name TEXT NOT NULL,
  size INTEGER NOT NULL,
  sha256 TEXT NOT NULL,
  PRIMARY KEY (scan, name)
) STRICT;
CREATE TABLE jobs (
  scan TEXT PRIMARY KEY REFERENCES scans(id) ON DELETE CASCADE,
  phase TEXT NOT NULL CHECK (phase IN ('queued', 'running', 'done', 'failed')),
  reason TEXT NOT NULL DEFAULT ''
) STRICT;
CREATE TABLE results (
  scan TEXT NOT NULL REFERENCES scans(id) ON DELETE CASCADE,
  name TEXT NOT NULL,
  size INTEGER NOT NULL,
  sha256 TEXT NOT NULL,
  PRIMARY KEY (scan, name)
) STRICT;
)",
                                                   R"(
CREATE TABLE deleted (
  scan TEXT PRIMARY KEY,
  at TEXT NOT NULL
) STRICT;
)",
                                                   R"(
ALTER TABLE jobs ADD COLUMN options TEXT NOT NULL DEFAULT '{}';
ALTER TABLE jobs ADD COLUMN tries INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN not_before INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN lease INTEGER NOT NULL DEFAULT 0;
ALTER TABLE jobs ADD COLUMN lease_until INTEGER NOT NULL DEFAULT 0;
ALTER TABLE scans ADD COLUMN delivered_at INTEGER NOT NULL DEFAULT 0;
UPDATE scans SET delivered_at = 1000 * CAST(strftime('%s', 'now') AS INTEGER) WHERE delivered <> 0;
)"};

constexpr const char* select_scan =
    "SELECT id, device_key, device_name, created, COALESCE(phase, 'receiving'), COALESCE(reason, ''), delivered, "
    "delivered_at FROM scans LEFT JOIN jobs ON jobs.scan = scans.id ";

StoredScan scan_of(const Statement& row) {
  StoredScan scan{
      row.text(0),           row.text(1), row.text(2),        row.text(3),
      StorePhase::receiving, row.text(5), row.number(6) != 0, WallTime(std::chrono::milliseconds(row.number(7)))};
  scan.phase = phase_named(row.text(4));
  return scan;
}

Result<void> migrate(Database& database, const fs::path& file) {
  const Result<std::optional<std::string>> version = first(database, "PRAGMA user_version");
  if (!version) return tl::unexpected(version.error());
  const auto known = static_cast<int>(migrations.size());
  const int from = std::stoi(version->value_or("0"));
  if (from > known) {
    return fail("the catalogue was written by a newer version", file.string(), "use that version of gyre-offload");
  }
  for (int step = from; step < known; ++step) {
    Database::Transaction transaction(database);
    if (Result<void> done = transaction.begin(); !done) return done;
    if (Result<void> done = database.execute(migrations[static_cast<std::size_t>(step)]); !done) return done;
    if (Result<void> done = database.execute("PRAGMA user_version = " + std::to_string(step + 1)); !done) return done;
    if (Result<void> done = transaction.commit(); !done) return done;
  }
  return {};
}

Result<void> check_integrity(Database& database, const fs::path& file) {
  const Result<std::optional<std::string>> verdict = first(database, "PRAGMA integrity_check(1)");
  if (verdict && *verdict == "ok") return {};
  return fail("the catalogue is damaged", file.string() + " (" + (verdict ? verdict->value_or("") : "unreadable") + ")",
              "restore it from a backup; the bundles in the store are not affected");
}

}  // namespace

Store::Store(fs::path folder, FolderLock lock, std::unique_ptr<Database> database)
    : folder_(std::move(folder)), lock_(std::move(lock)), database_(std::move(database)) {}

Store::~Store() = default;

Result<std::unique_ptr<Store>> Store::open(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder / "scans", error);
  if (!error) fs::create_directories(folder / "incoming", error);
  if (error) return fail("cannot create the store", folder.string() + " (" + error.message() + ")");
  Result<FolderLock> lock = FolderLock::take(folder);
  if (!lock) return tl::unexpected(lock.error());
  const fs::path file = folder / "catalogue.sqlite";
  Result<Database> opened = Database::open(file);
  if (!opened) return tl::unexpected(opened.error());
  auto database = std::make_unique<Database>(std::move(*opened));
  if (Result<void> good = check_integrity(*database, file); !good) return tl::unexpected(good.error());
  if (Result<void> done = migrate(*database, file); !done) return tl::unexpected(done.error());
  const Result<void> queued =
      run(*database, "UPDATE jobs SET phase = 'queued', lease_until = 0 WHERE phase = 'running'");
  if (!queued) return tl::unexpected(queued.error());
  std::unique_ptr<Store> store(new Store(folder, std::move(*lock), std::move(database)));
  if (Result<void> done = store->finish_deletions(); !done) return tl::unexpected(done.error());
  return store;
}

Result<void> Store::open_scan(const Scan& scan, const std::string& device_key, const std::string& device_name) {
  if (!is_ulid(scan.id)) return wrong_use("not a scan id", scan.id);
  const std::lock_guard guard(mutex_);
  const auto owner = first(*database_, "SELECT device_key FROM scans WHERE id = ?", std::string_view(scan.id));
  if (!owner) return tl::unexpected(owner.error());
  if (*owner && **owner != device_key) return fail("the scan belongs to another device", scan.id);
  const auto gone = first(*database_, "SELECT at FROM deleted WHERE scan = ?", std::string_view(scan.id));
  if (!gone) return tl::unexpected(gone.error());
  if (*gone) return fail("the scan was deleted here on " + **gone, scan.id, "it does not come back by itself");
  const auto phase = first(*database_, "SELECT phase FROM jobs WHERE scan = ?", std::string_view(scan.id));
  if (!phase) return tl::unexpected(phase.error());
  std::error_code error;
  if (*phase) {
    fs::remove_all(incoming(scan.id), error);  // all of it has come; a crash may have left some
  } else {
    fs::create_directories(incoming(scan.id), error);
  }
  if (error)
    return fail("cannot create a folder in the store", incoming(scan.id).string() + " (" + error.message() + ")");
  if (*owner && fs::exists(bundle(scan.id).frames())) return {};
  // The folder first: a scan in the catalogue always has one.
  if (const Result<Bundle> created = create_bundle(bundle(scan.id).root(), scan); !created) {
    return tl::unexpected(created.error());
  }
  if (Result<void> synced = sync_path(folder_ / "scans"); !synced) return synced;
  return run(*database_,
             "INSERT INTO scans (id, device_key, device_name, created) VALUES (?, ?, ?, ?) ON CONFLICT DO NOTHING",
             std::string_view(scan.id), std::string_view(device_key), std::string_view(device_name),
             std::string_view(scan.created));
}

Result<std::optional<StoredScan>> Store::scan(const std::string& scan_id) const {
  const std::lock_guard guard(mutex_);
  Result<Statement> statement = database_->prepare(std::string(select_scan) + "WHERE id = ?");
  if (!statement) return tl::unexpected(statement.error());
  const Result<bool> row = statement->bind(std::string_view(scan_id)).step();
  if (!row) return tl::unexpected(row.error());
  return *row ? std::optional(scan_of(*statement)) : std::nullopt;
}

Result<std::vector<StoredScan>> Store::scans() const {
  const std::lock_guard guard(mutex_);
  Result<Statement> statement = database_->prepare(std::string(select_scan) + "ORDER BY id");
  if (!statement) return tl::unexpected(statement.error());
  std::vector<StoredScan> scans;
  while (true) {
    const Result<bool> row = statement->step();
    if (!row) return tl::unexpected(row.error());
    if (!*row) return scans;
    scans.push_back(scan_of(*statement));
  }
}

Result<void> Store::add_entry(const char* sql, const std::string& scan_id, const StoredFile& file) const {
  return run(*database_, sql, std::string_view(scan_id), std::string_view(file.name),
             static_cast<std::int64_t>(file.size), std::string_view(file.sha256));
}

Result<std::vector<StoredFile>> Store::entries(const char* sql, const std::string& scan_id) const {
  Result<Statement> statement = database_->prepare(sql);
  if (!statement) return tl::unexpected(statement.error());
  statement->bind(std::string_view(scan_id));
  std::vector<StoredFile> files;
  while (true) {
    const Result<bool> row = statement->step();
    if (!row) return tl::unexpected(row.error());
    if (!*row) return files;
    files.push_back({statement->text(0), static_cast<std::uint64_t>(statement->number(1)), statement->text(2)});
  }
}

Result<void> Store::add_file(const std::string& scan_id, const StoredFile& file) {
  const std::lock_guard guard(mutex_);
  return add_entry("INSERT OR REPLACE INTO files (scan, name, size, sha256) VALUES (?, ?, ?, ?)", scan_id, file);
}

Result<void> Store::remove_file(const std::string& scan_id, const std::string& name) {
  const std::lock_guard guard(mutex_);
  return run(*database_, "DELETE FROM files WHERE scan = ? AND name = ?", std::string_view(scan_id),
             std::string_view(name));
}

Result<std::vector<StoredFile>> Store::files(const std::string& scan_id) const {
  const std::lock_guard guard(mutex_);
  return entries("SELECT name, size, sha256 FROM files WHERE scan = ? ORDER BY name", scan_id);
}

Result<std::optional<StoredFile>> Store::file(const std::string& scan_id, const std::string& name) const {
  const std::lock_guard guard(mutex_);
  Result<Statement> statement = database_->prepare("SELECT name, size, sha256 FROM files WHERE scan = ? AND name = ?");
  if (!statement) return tl::unexpected(statement.error());
  const Result<bool> row = statement->bind(std::string_view(scan_id)).bind(std::string_view(name)).step();
  if (!row) return tl::unexpected(row.error());
  if (!*row) return std::optional<StoredFile>();
  return StoredFile{statement->text(0), static_cast<std::uint64_t>(statement->number(1)), statement->text(2)};
}

Result<std::vector<StoredFile>> Store::results(const std::string& scan_id) const {
  const std::lock_guard guard(mutex_);
  return entries("SELECT name, size, sha256 FROM results WHERE scan = ? ORDER BY name", scan_id);
}

Result<void> Store::set_delivered(const std::string& scan_id, WallTime now) {
  const std::lock_guard guard(mutex_);
  if (const Result<StorePhase> next = step(scan_id, ScanEvent::delivered); !next) return tl::unexpected(next.error());
  return run(*database_, "UPDATE scans SET delivered = 1, delivered_at = ? WHERE id = ?",
             static_cast<std::int64_t>(now.time_since_epoch().count()), std::string_view(scan_id));
}

}  // namespace gyre
