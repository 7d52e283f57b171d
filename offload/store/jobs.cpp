// SPDX-License-Identifier: Apache-2.0
// The part of the store that keeps jobs: who works on a scan, until when, and what became of it.
#include "offload/store/database.h"
#include "offload/store/store.h"

#include <nlohmann/json.hpp>

namespace gyre {

namespace {

// Ends of leases further ahead than this were written before the clock was set back, and do not count.
constexpr std::chrono::milliseconds clock_jump = std::chrono::hours(24);

constexpr const char* select_job = "SELECT scan, phase, reason, options, tries, not_before, lease FROM jobs ";

std::int64_t milliseconds_of(WallTime time) {
  return time.time_since_epoch().count();
}

StoredJob job_of(const Statement& row) {
  return {row.text(0),  phase_named(row.text(1)),        row.text(2),
          row.text(3),  static_cast<int>(row.number(4)), WallTime(std::chrono::milliseconds(row.number(5))),
          row.number(6)};
}

Result<std::optional<StoredJob>> job_in(Database& database, const std::string& scan_id) {
  std::string sql = select_job;
  sql += "WHERE scan = ?";
  Result<Statement> statement = database.prepare(sql);
  if (!statement) return tl::unexpected(statement.error());
  const Result<bool> row = statement->bind(std::string_view(scan_id)).step();
  if (!row) return tl::unexpected(row.error());
  return *row ? std::optional(job_of(*statement)) : std::nullopt;
}

}  // namespace

// The phase the event leads to from where the scan is now. The mutex is held.
Result<StorePhase> Store::step(const std::string& scan_id, ScanEvent event) const {
  const auto now = first(*database_,
                         "SELECT COALESCE(phase, 'receiving') FROM scans LEFT JOIN jobs ON jobs.scan = scans.id "
                         "WHERE id = ?",
                         std::string_view(scan_id));
  if (!now) return tl::unexpected(now.error());
  if (!*now) return fail("no such scan in the store", scan_id);
  const std::optional<StorePhase> next = next_phase(phase_named(**now), event);
  if (next) return *next;
  return fail("the scan is " + **now + " and cannot be " + std::string(name_of(event)), scan_id);
}

Result<void> Store::queue_job(const std::string& scan_id) {
  const std::lock_guard guard(mutex_);
  const Result<StorePhase> next = step(scan_id, ScanEvent::completed);
  if (!next) return tl::unexpected(next.error());
  if (*next != StorePhase::queued) return {};
  return run(*database_, "INSERT INTO jobs (scan, phase) VALUES (?, 'queued') ON CONFLICT DO NOTHING",
             std::string_view(scan_id));
}

Result<void> Store::retry_job(const std::string& scan_id, const std::string& changes) {
  const std::lock_guard guard(mutex_);
  if (const Result<StorePhase> next = step(scan_id, ScanEvent::retried); !next) return tl::unexpected(next.error());
  return run(
      *database_,
      "UPDATE jobs SET phase = 'queued', reason = '', tries = 0, not_before = 0, options = json_patch(options, ?) "
      "WHERE scan = ?",
      std::string_view(changes), std::string_view(scan_id));
}

Result<std::optional<StoredJob>> Store::take_job(WallTime now, std::chrono::milliseconds lease,
                                                 const std::vector<std::string>& except) {
  const std::lock_guard guard(mutex_);
  // A device with less in work goes first, so that one with many scans does not keep the others waiting.
  const auto taken =
      first(*database_,
            "UPDATE jobs SET phase = 'running', tries = tries + 1, lease = lease + 1, lease_until = ?1 WHERE scan = ("
            "SELECT jobs.scan FROM jobs JOIN scans ON scans.id = jobs.scan WHERE phase = 'queued' AND "
            "not_before NOT BETWEEN ?2 + 1 AND ?2 + ?3 AND jobs.scan NOT IN (SELECT value FROM json_each(?4)) ORDER BY "
            "(SELECT COUNT(*) FROM jobs AS j JOIN scans AS s ON "
            "s.id = j.scan WHERE j.phase = 'running' AND s.device_key = scans.device_key), jobs.scan LIMIT 1) "
            "RETURNING scan",
            milliseconds_of(now + lease), milliseconds_of(now), longest_retry_wait.count(),
            std::string_view(nlohmann::json(except).dump()));
  if (!taken) return tl::unexpected(taken.error());
  if (!*taken) return std::optional<StoredJob>();
  return job_in(*database_, **taken);
}

Result<std::vector<StoredJob>> Store::jobs() const {
  const std::lock_guard guard(mutex_);
  Result<Statement> statement = database_->prepare(std::string(select_job) + "ORDER BY scan");
  if (!statement) return tl::unexpected(statement.error());
  std::vector<StoredJob> jobs;
  while (true) {
    const Result<bool> row = statement->step();
    if (!row) return tl::unexpected(row.error());
    if (!*row) return jobs;
    jobs.push_back(job_of(*statement));
  }
}

Result<bool> Store::renew_lease(const std::string& scan_id, std::int64_t lease, WallTime until) {
  const std::lock_guard guard(mutex_);
  const auto renewed = first(*database_,
                             "UPDATE jobs SET lease_until = ? WHERE scan = ? AND phase = 'running' AND lease = ? "
                             "RETURNING scan",
                             milliseconds_of(until), std::string_view(scan_id), lease);
  if (!renewed) return tl::unexpected(renewed.error());
  return renewed->has_value();
}

Result<std::vector<std::string>> Store::take_back_lapsed(WallTime now) {
  const std::lock_guard guard(mutex_);
  Result<Statement> statement = database_->prepare(
      "UPDATE jobs SET phase = 'queued', lease_until = 0, reason = 'its runner fell silent' WHERE phase = 'running' "
      "AND "
      "lease_until NOT BETWEEN ?1 AND ?1 + ?2 RETURNING scan");
  if (!statement) return tl::unexpected(statement.error());
  statement->bind(milliseconds_of(now)).bind(clock_jump.count());
  std::vector<std::string> lapsed;
  while (true) {
    const Result<bool> row = statement->step();
    if (!row) return tl::unexpected(row.error());
    if (!*row) return lapsed;
    lapsed.push_back(statement->text(0));
  }
}

Result<void> Store::put_back_job(const std::string& scan_id, const std::string& reason, WallTime not_before) {
  const std::lock_guard guard(mutex_);
  const Result<StorePhase> next = step(scan_id, ScanEvent::interrupted);
  if (!next) return tl::unexpected(next.error());
  return run(*database_, "UPDATE jobs SET phase = 'queued', lease_until = 0, reason = ?, not_before = ? WHERE scan = ?",
             std::string_view(reason), milliseconds_of(not_before), std::string_view(scan_id));
}

Result<void> Store::finish_job(const std::string& scan_id, const std::vector<StoredFile>& results) {
  const std::lock_guard guard(mutex_);
  if (const Result<StorePhase> next = step(scan_id, ScanEvent::finished); !next) return tl::unexpected(next.error());
  Database::Transaction transaction(*database_);
  if (Result<void> done = transaction.begin(); !done) return done;
  const std::string_view id = scan_id;
  if (Result<void> done = run(*database_, "DELETE FROM results WHERE scan = ?", id); !done) return done;
  for (const StoredFile& file : results) {
    const Result<void> added =
        add_entry("INSERT INTO results (scan, name, size, sha256) VALUES (?, ?, ?, ?)", scan_id, file);
    if (!added) return added;
  }
  const Result<void> set =
      run(*database_, "UPDATE jobs SET phase = 'done', reason = '', lease_until = 0 WHERE scan = ?", id);
  if (!set) return set;
  if (Result<void> done = run(*database_, "UPDATE scans SET delivered = 0, delivered_at = 0 WHERE id = ?", id); !done)
    return done;
  return transaction.commit();
}

Result<void> Store::fail_job(const std::string& scan_id, const std::string& reason) {
  const std::lock_guard guard(mutex_);
  if (!step(scan_id, ScanEvent::unusable)) {
    if (const Result<StorePhase> next = step(scan_id, ScanEvent::failed); !next) return tl::unexpected(next.error());
  }
  return run(*database_,
             "INSERT INTO jobs (scan, phase, reason) VALUES (?, 'failed', ?) "
             "ON CONFLICT DO UPDATE SET phase = 'failed', reason = excluded.reason, lease_until = 0",
             std::string_view(scan_id), std::string_view(reason));
}

}  // namespace gyre
