// SPDX-License-Identifier: Apache-2.0
// SQLite behind Result: a connection, prepared statements, transactions.
#pragma once

#include "common/result/result.h"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

struct sqlite3;
struct sqlite3_stmt;

namespace gyre {

// A prepared statement: bind in order, then step until there is no row.
class Statement {
 public:
  Statement& bind(std::string_view text);
  Statement& bind(std::int64_t number);

  // True while there is a row to read.
  Result<bool> step();
  // For statements without rows.
  Result<void> run();

  std::string text(int column) const;
  std::int64_t number(int column) const;

 private:
  friend class Database;
  struct Finalise {
    void operator()(sqlite3_stmt* statement) const;
  };
  Statement(sqlite3* connection, sqlite3_stmt* statement) : connection_(connection), statement_(statement) {}
  void check(int code);

  sqlite3* connection_;
  std::unique_ptr<sqlite3_stmt, Finalise> statement_;
  int bound_ = 0;
  int error_ = 0;  // the first failed bind
};

// A connection for one thread at a time. Commits are on disk when they return (write-ahead log, full sync).
class Database {
 public:
  static Result<Database> open(const std::filesystem::path& file);

  Result<void> execute(const std::string& sql);
  // sql: one statement.
  Result<Statement> prepare(std::string_view sql);

  // Everything between begin and commit happens or none of it; a Transaction that goes uncommitted is rolled back.
  class Transaction {
   public:
    explicit Transaction(Database& database) : database_(database) {}
    Transaction(const Transaction&) = delete;
    Transaction& operator=(const Transaction&) = delete;
    ~Transaction();
    Result<void> begin();
    Result<void> commit();

   private:
    Database& database_;
    bool open_ = false;
  };

 private:
  struct Close {
    void operator()(sqlite3* connection) const;
  };
  explicit Database(sqlite3* connection) : connection_(connection) {}

  std::unique_ptr<sqlite3, Close> connection_;
};

// Prepares and runs a statement without rows.
template <class... Values>
Result<void> run(Database& database, const char* sql, const Values&... values) {
  Result<Statement> statement = database.prepare(sql);
  if (!statement) return tl::unexpected(statement.error());
  (statement->bind(values), ...);
  return statement->run();
}

// First column of the first row, or nothing.
template <class... Values>
Result<std::optional<std::string>> first(Database& database, const char* sql, const Values&... values) {
  Result<Statement> statement = database.prepare(sql);
  if (!statement) return tl::unexpected(statement.error());
  (statement->bind(values), ...);
  std::optional<std::string> value;
  while (true) {  // to the end: a statement that writes is committed only then
    const Result<bool> row = statement->step();
    if (!row) return tl::unexpected(row.error());
    if (!*row) return value;
    if (!value) value = statement->text(0);
  }
}

}  // namespace gyre
