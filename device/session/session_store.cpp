// SPDX-License-Identifier: Apache-2.0
#include "device/session/session_store.h"

#include "common/bundle/atomic_file.h"

#include <nlohmann/json.hpp>
#include <sstream>

namespace gyre {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::optional<SessionState> state_named(const std::string& name) {
  for (int i = 0; i < session_state_count; ++i) {
    if (name_of(static_cast<SessionState>(i)) == name) return static_cast<SessionState>(i);
  }
  return std::nullopt;
}

Result<void> make_folder(const fs::path& folder) {
  std::error_code error;
  const bool is_new = fs::create_directories(folder, error);
  if (error) return fail("cannot create the folder", folder.string() + " (" + error.message() + ")");
  return is_new ? sync_path(folder.parent_path()) : Result<void>();
}

}  // namespace

void SessionStore::tidy() const {
  remove_temporaries(folder_);
}

Result<void> SessionStore::save(const StoredSession& session) const {
  if (const Result<void> made = make_folder(folder_); !made) return made;
  json entry = {{"version", 1}, {"state", name_of(session.state)}, {"pass", session.pass}, {"scan", nullptr}};
  if (session.scan) entry["scan"] = to_json(*session.scan);
  return write_file(folder_ / "session.json", entry.dump() + "\n");
}

std::optional<StoredSession> SessionStore::load() const {
  const Result<std::string> text = read_file(folder_ / "session.json");
  if (!text) return std::nullopt;
  const json entry = json::parse(*text, nullptr, false);
  if (!entry.is_object()) return std::nullopt;
  for (const char* const name : {"version", "state", "pass", "scan"}) {
    if (!entry.contains(name)) return std::nullopt;
  }
  if (entry["version"] != 1 || !entry["state"].is_string() || !entry["pass"].is_string()) return std::nullopt;
  StoredSession session;
  const std::optional<SessionState> state = state_named(entry["state"]);
  if (!state) return std::nullopt;
  session.state = *state;
  session.pass = entry["pass"];
  if (entry["scan"].is_null()) return session;
  Result<Scan> scan = scan_from_json(entry["scan"]);
  if (!scan) return std::nullopt;
  session.scan = std::move(*scan);
  return session;
}

fs::path SessionStore::file_of(const std::string& scan, const std::string& pass) const {
  return folder_ / (scan + "-" + pass + ".jsonl");
}

Result<void> SessionStore::save_records(const std::string& scan, const std::string& pass,
                                        const std::vector<FrameRecord>& records) const {
  if (const Result<void> made = make_folder(folder_); !made) return made;
  std::string lines;
  for (const FrameRecord& record : records) lines += to_json(record).dump() + "\n";
  return write_file(file_of(scan, pass), lines);
}

Result<std::vector<FrameRecord>> SessionStore::load_records(const std::string& scan, const std::string& pass) const {
  const Result<std::string> text = read_file(file_of(scan, pass));
  if (!text) return tl::unexpected(text.error());
  std::vector<FrameRecord> records;
  std::istringstream lines(*text);
  for (std::string line; std::getline(lines, line);) {
    const json entry = json::parse(line, nullptr, false);
    if (!entry.is_object()) return fail("not a frame's record", line);
    Result<FrameRecord> record = frame_record_from_json(entry);
    if (!record) return tl::unexpected(record.error());
    records.push_back(std::move(*record));
  }
  return records;
}

void SessionStore::forget_records() const {
  std::error_code error;
  for (auto it = fs::directory_iterator(folder_, error); !error && it != fs::directory_iterator();
       it.increment(error)) {
    std::error_code ignored;
    if (it->path().extension() == ".jsonl") fs::remove(it->path(), ignored);
  }
}

}  // namespace gyre
