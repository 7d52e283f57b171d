// SPDX-License-Identifier: Apache-2.0
#include "offload/store/database.h"

#include <sqlite3.h>

namespace gyre {

namespace {

tl::unexpected<Error> sqlite_error(sqlite3* connection) {
  const bool full = sqlite3_errcode(connection) == SQLITE_FULL;
  const char* file = sqlite3_db_filename(connection, "main");
  return fail("the catalogue failed", std::string(file ? file : "") + " (" + sqlite3_errmsg(connection) + ")",
              full ? "free some disk space and try again" : "");
}

}  // namespace

void Statement::Finalise::operator()(sqlite3_stmt* statement) const {
  sqlite3_finalize(statement);
}

void Statement::check(int code) {
  if (error_ == SQLITE_OK) error_ = code;
}

Statement& Statement::bind(std::string_view text) {
  check(sqlite3_bind_text(statement_.get(), ++bound_, text.data(), static_cast<int>(text.size()), SQLITE_TRANSIENT));
  return *this;
}

Statement& Statement::bind(std::int64_t number) {
  check(sqlite3_bind_int64(statement_.get(), ++bound_, number));
  return *this;
}

Result<bool> Statement::step() {
  if (error_ != SQLITE_OK) return sqlite_error(connection_);
  const int code = sqlite3_step(statement_.get());
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  return sqlite_error(connection_);
}

Result<void> Statement::run() {
  const Result<bool> row = step();
  if (!row) return tl::unexpected(row.error());
  return {};
}

std::string Statement::text(int column) const {
  const auto* bytes = sqlite3_column_text(statement_.get(), column);
  const int size = sqlite3_column_bytes(statement_.get(), column);
  return bytes ? std::string(reinterpret_cast<const char*>(bytes), static_cast<std::size_t>(size)) : std::string();
}

std::int64_t Statement::number(int column) const {
  return sqlite3_column_int64(statement_.get(), column);
}

void Database::Close::operator()(sqlite3* connection) const {
  sqlite3_close_v2(connection);
}

Result<Database> Database::open(const std::filesystem::path& file) {
  sqlite3* connection = nullptr;
  const int code = sqlite3_open_v2(file.c_str(), &connection,
                                   SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_FULLMUTEX, nullptr);
  Database database(connection);
  if (code != SQLITE_OK) return fail("cannot open the catalogue", file.string());
  sqlite3_busy_timeout(connection, 5000);  // a reader such as `sqlite3` on the command line
  const Result<void> set = database.execute(
      "PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; PRAGMA foreign_keys = ON; PRAGMA trusted_schema = OFF; "
      "PRAGMA secure_delete = ON;");
  if (!set) return tl::unexpected(set.error());
  return database;
}

Result<void> Database::execute(const std::string& sql) {
  if (sqlite3_exec(connection_.get(), sql.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) {
    return sqlite_error(connection_.get());
  }
  return {};
}

Result<Statement> Database::prepare(std::string_view sql) {
  sqlite3_stmt* statement = nullptr;
  if (sqlite3_prepare_v2(connection_.get(), sql.data(), static_cast<int>(sql.size()), &statement, nullptr) !=
      SQLITE_OK) {
    return sqlite_error(connection_.get());
  }
  return Statement(connection_.get(), statement);
}

Database::Transaction::~Transaction() {
  if (open_) static_cast<void>(database_.execute("ROLLBACK"));
}

Result<void> Database::Transaction::begin() {
  Result<void> begun = database_.execute("BEGIN IMMEDIATE");
  open_ = begun.has_value();
  return begun;
}

Result<void> Database::Transaction::commit() {
  Result<void> committed = database_.execute("COMMIT");
  if (committed) open_ = false;
  return committed;
}

}  // namespace gyre
