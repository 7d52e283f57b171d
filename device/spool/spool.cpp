// SPDX-License-Identifier: Apache-2.0
#include "device/spool/spool.h"

#include "common/bundle/atomic_file.h"
#include "common/bundle/disk_space.h"
#include "common/bundle/sha256.h"
#include "common/bundle/ulid.h"
#include "device/spool/journal.h"

#include <spdlog/spdlog.h>
#include <algorithm>
#include <set>
#include <system_error>

namespace gyre {

namespace {

namespace fs = std::filesystem;
using Kind = SpoolEvent::Kind;

constexpr std::string_view scan_file = "scan.json";
constexpr std::string_view frame_log = "frames.jsonl";

bool is_spoolable(const std::string& name) {
  if (name == scan_file || name == frame_log) return true;
  constexpr std::string_view folder = "frames/";
  return name.starts_with(folder) && parse_frame_name(std::string_view(name).substr(folder.size())).has_value();
}

std::vector<fs::path> files_in(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (auto it = fs::directory_iterator(folder, error); !error && it != fs::directory_iterator(); it.increment(error)) {
    if (it->is_regular_file(error)) files.push_back(it->path());
  }
  return files;
}

void remove_quietly(const fs::path& file) {
  std::error_code ignored;
  fs::remove(file, ignored);
}

SpoolEvent file_event(const std::string& name, std::uint64_t size, std::string sha256) {
  return {.kind = Kind::file, .name = name, .size = size, .sha256 = std::move(sha256), .reason = {}};
}

SpoolEvent event_named(Kind kind, const std::string& name = {}) {
  return {.kind = kind, .name = name, .size = 0, .sha256 = {}, .reason = {}};
}

// The keyframes that records ask for and those in the spool, as names; they have to be the same.
Result<void> check_selection(const SpooledScan& scan, const std::vector<FrameRecord>& records) {
  std::set<std::string> chosen;
  for (const FrameRecord& record : records) {
    if (record.decision == "keyframe") chosen.insert("frames/" + frame_name(record.pass, record.index));
  }
  for (const SpooledFile& file : scan.files) {
    if (file.phase == SpooledFilePhase::discarded || !file.name.starts_with("frames/")) continue;
    if (chosen.erase(file.name) == 0) return fail("a spooled keyframe was neither selected nor discarded", file.name);
  }
  if (!chosen.empty()) return fail("a selected keyframe is not in the spool", *chosen.begin());
  return {};
}

}  // namespace

struct Spool::Entry {
  SpooledScan scan;
  SpoolJournal journal;

  // On disk first, then in memory.
  Result<void> record(const SpoolEvent& event) {
    SpooledScan next = scan;
    if (Result<void> possible = apply(next, event); !possible) return possible;
    if (Result<void> written = journal.append(event); !written) return written;
    scan = std::move(next);
    return {};
  }
};

Spool::Spool(fs::path folder, FolderLock lock, std::uint64_t reserve_bytes)
    : folder_(std::move(folder)), lock_(std::move(lock)), reserve_bytes_(reserve_bytes) {}

Spool::~Spool() = default;

Result<std::unique_ptr<Spool>> Spool::open(const fs::path& folder, std::uint64_t reserve_bytes) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return fail("cannot create the spool", folder.string() + " (" + error.message() + ")");
  Result<FolderLock> lock = FolderLock::take(folder);
  if (!lock) return tl::unexpected(lock.error());
  std::unique_ptr<Spool> spool(new Spool(folder, std::move(*lock), reserve_bytes));
  for (auto it = fs::directory_iterator(folder, error); !error && it != fs::directory_iterator(); it.increment(error)) {
    const std::string id = it->path().filename().string();
    if (!is_ulid(id) || !fs::exists(spool->journal_file(id))) continue;
    // One damaged scan must not keep the device from working.
    if (Result<void> loaded = spool->load(id); !loaded) spdlog::error("{}", loaded.error().message());
  }
  if (error) return fail("cannot list the spool", folder.string() + " (" + error.message() + ")");
  return spool;
}

fs::path Spool::journal_file(const std::string& scan_id) const {
  return folder_ / scan_id / "spool.jsonl";
}

Result<void> Spool::load(const std::string& scan_id) {
  std::vector<SpoolEvent> events;
  Result<SpoolJournal> journal = SpoolJournal::open(journal_file(scan_id), events);
  if (!journal) return tl::unexpected(journal.error());
  if (events.empty() || events.front().kind != Kind::opened) return {};  // open_scan did not return
  auto entry = std::make_unique<Entry>(Entry{{}, std::move(*journal)});
  entry->scan.id = scan_id;
  for (std::size_t i = 1; i < events.size(); ++i) {
    if (Result<void> applied = apply(entry->scan, events[i]); !applied) return applied;
  }
  if (Result<void> repaired = repair(*entry); !repaired) return repaired;
  scans_[scan_id] = std::move(entry);
  return {};
}

// After a crash: removes what no call promised to keep; a file that was being replaced is taken as it is on disk, since
// it is whole and is what the caller wanted.
Result<void> Spool::repair(Entry& entry) {
  const Bundle bundle = this->bundle(entry.scan.id);
  remove_temporaries(bundle.root());
  for (const fs::path& file : files_in(bundle.frames())) {
    const SpooledFile* known = find_file(entry.scan.files, "frames/" + file.filename().string());
    if (!known || known->phase == SpooledFilePhase::discarded) remove_quietly(file);
  }
  if (entry.scan.phase != SpoolPhase::recording) return {};
  const std::vector<SpooledFile> files = entry.scan.files;
  for (const SpooledFile& file : files) {
    if (file.phase == SpooledFilePhase::discarded) continue;
    const fs::path path = bundle.root() / file.name;
    Result<std::string> hash = sha256_of_file(path);
    if (hash && *hash == file.sha256) continue;
    std::error_code error;
    const Result<void> done = hash ? entry.record(file_event(file.name, fs::file_size(path, error), std::move(*hash)))
                                   : entry.record(event_named(Kind::discarded, file.name));
    if (!done) return done;
  }
  return {};
}

Result<Spool::Entry*> Spool::find(const std::string& scan_id) const {
  const auto found = scans_.find(scan_id);
  if (found == scans_.end()) return fail("no such scan in the spool", scan_id);
  return found->second.get();
}

Result<void> Spool::record(const std::string& scan_id, const SpoolEvent& event) {
  const std::lock_guard lock(mutex_);
  const Result<Entry*> entry = find(scan_id);
  if (!entry) return tl::unexpected(entry.error());
  return (*entry)->record(event);
}

Result<void> Spool::open_scan(const Scan& scan) {
  if (!is_ulid(scan.id)) return wrong_use("not a scan id", scan.id);
  {
    const std::lock_guard lock(mutex_);
    if (const Result<Entry*> entry = find(scan.id)) {
      if ((*entry)->scan.phase == SpoolPhase::recording) return {};
      return fail("the scan is already closed", scan.id);
    }
    if (Result<Bundle> created = create_bundle(folder_ / scan.id, scan); !created) {
      return tl::unexpected(created.error());
    }
    std::vector<SpoolEvent> events;
    Result<SpoolJournal> journal = SpoolJournal::open(journal_file(scan.id), events);
    if (!journal) return tl::unexpected(journal.error());
    if (!events.empty()) return fail("a damaged scan has the same id", scan.id);
    auto entry = std::make_unique<Entry>(Entry{{}, std::move(*journal)});
    entry->scan.id = scan.id;
    if (Result<void> written = entry->journal.append(event_named(Kind::opened)); !written) return written;
    if (Result<void> synced = sync_path(folder_); !synced) return synced;
    scans_[scan.id] = std::move(entry);
  }
  notify();
  return {};
}

Result<void> Spool::add_file(const std::string& scan_id, const std::string& name, std::span<const std::byte> bytes) {
  if (!is_spoolable(name)) return wrong_use("not the name of a keyframe", name);
  std::string hash = sha256(bytes);
  {
    const std::lock_guard lock(mutex_);
    const Result<Entry*> entry = find(scan_id);
    if (!entry) return tl::unexpected(entry.error());
    if (const SpooledFile* known = find_file((*entry)->scan.files, name);
        known && known->phase != SpooledFilePhase::discarded && known->sha256 == hash) {
      return {};
    }
    if ((*entry)->scan.phase != SpoolPhase::recording) return fail("the scan is already closed", scan_id);
    if (Result<void> room = make_room(bytes.size()); !room) return room;
    if (Result<void> written = write_file(bundle(scan_id).root() / name, bytes); !written) return written;
    const Result<void> recorded = (*entry)->record(file_event(name, bytes.size(), std::move(hash)));
    if (!recorded) return recorded;
    ++counts_.frames;
    counts_.bytes += bytes.size();
  }
  notify();
  return {};
}

Result<void> Spool::discard(const std::string& scan_id, const std::string& name) {
  {
    const std::lock_guard lock(mutex_);
    const Result<Entry*> entry = find(scan_id);
    if (!entry) return tl::unexpected(entry.error());
    const SpooledFile* known = find_file((*entry)->scan.files, name);
    if (!known || known->phase == SpooledFilePhase::discarded) return {};
    if (Result<void> recorded = (*entry)->record(event_named(Kind::discarded, name)); !recorded) return recorded;
    ++counts_.discarded;
    remove_quietly(bundle(scan_id).root() / name);
  }
  notify();
  return {};
}

Result<void> Spool::close_scan(const Scan& scan, const std::vector<FrameRecord>& records) {
  const std::optional<SpooledScan> now = this->scan(scan.id);
  if (!now) return fail("no such scan in the spool", scan.id);
  if (now->phase != SpoolPhase::recording) return {};
  if (Result<void> same = check_selection(*now, records); !same) return same;
  const Bundle bundle = this->bundle(scan.id);
  if (Result<void> written = write_scan(bundle, scan); !written) return written;
  if (Result<void> written = write_frame_log(bundle, records); !written) return written;
  for (const std::string_view name : {scan_file, frame_log}) {
    const Result<std::string> content = read_file(bundle.root() / name);
    if (!content) return tl::unexpected(content.error());
    Result<void> recorded = record(scan.id, file_event(std::string(name), content->size(), sha256(*content)));
    if (!recorded) return recorded;
  }
  if (Result<void> closed = record(scan.id, event_named(Kind::closed)); !closed) return closed;
  notify();
  return {};
}

std::optional<SpooledScan> Spool::scan(const std::string& scan_id) const {
  const std::lock_guard lock(mutex_);
  const Result<Entry*> entry = find(scan_id);
  return entry ? std::optional((*entry)->scan) : std::nullopt;
}

std::optional<SpoolPhase> Spool::phase(const std::string& scan_id) const {
  const std::lock_guard lock(mutex_);
  const Result<Entry*> entry = find(scan_id);
  return entry ? std::optional((*entry)->scan.phase) : std::nullopt;
}

std::vector<std::string> Spool::scan_ids() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> ids;
  for (const auto& [id, entry] : scans_) ids.push_back(id);
  return ids;
}

SpoolWaiting Spool::waiting() const {
  SpoolWaiting waiting;
  const std::lock_guard lock(mutex_);
  for (const auto& [id, entry] : scans_) {
    const SpooledScan& scan = entry->scan;
    if (scan.phase != SpoolPhase::recording && scan.phase != SpoolPhase::closed) continue;
    ++waiting.scans;
    for (const SpooledFile& file : scan.files) {
      if (file.phase != SpooledFilePhase::spooled) continue;
      ++waiting.files;
      waiting.bytes += file.size;
    }
  }
  return waiting;
}

Result<void> Spool::remove_scan(const std::string& scan_id) {
  const std::lock_guard lock(mutex_);
  const Result<Entry*> entry = find(scan_id);
  if (!entry) return tl::unexpected(entry.error());
  const SpoolPhase phase = (*entry)->scan.phase;
  if (phase == SpoolPhase::recording || phase == SpoolPhase::closed) {
    return fail("the host does not have the whole scan yet", scan_id, "it can be removed when it has");
  }
  return erase(scan_id);
}

// The mutex is held.
Result<void> Spool::erase(const std::string& scan_id) {
  scans_.erase(scan_id);
  std::error_code error;
  fs::remove_all(folder_ / scan_id, error);
  if (error) return fail("cannot remove the scan", scan_id + " (" + error.message() + ")");
  return sync_path(folder_);
}

// Sees to it that the reserve is still there after `bytes` more. The mutex is held.
Result<void> Spool::make_room(std::uint64_t bytes) {
  while (true) {
    const Result<std::uint64_t> left = free_bytes(folder_);
    if (!left) return tl::unexpected(left.error());
    if (*left >= reserve_bytes_ + bytes) return {};
    const auto oldest = std::find_if(scans_.begin(), scans_.end(), [](const auto& entry) {
      return entry.second->scan.phase == SpoolPhase::delivered;
    });
    if (oldest == scans_.end()) {
      ++counts_.no_room;
      return fail("this device's disk is nearly full",
                  folder_.string() + " (" + std::to_string(*left >> 20) + " MiB left)",
                  "end the scan with what it has; then let the host fetch what waits here, or free some space");
    }
    const std::string id = oldest->first;
    spdlog::info("scan {} makes room for another: the host has it, and its results were here", id);
    if (Result<void> gone = erase(id); !gone) return gone;
  }
}

Result<std::uint64_t> Spool::room() const {
  const Result<std::uint64_t> left = free_bytes(folder_);
  if (!left) return left;
  const std::lock_guard lock(mutex_);
  std::uint64_t all = *left;
  for (const auto& [id, entry] : scans_) {
    if (entry->scan.phase != SpoolPhase::delivered) continue;
    for (const auto* files : {&entry->scan.files, &entry->scan.results}) {
      for (const SpooledFile& file : *files) {
        if (file.phase != SpooledFilePhase::discarded) all += file.size;
      }
    }
  }
  return all > reserve_bytes_ ? all - reserve_bytes_ : 0;
}

void Spool::on_change(std::function<void()> listener) {
  const std::lock_guard lock(listener_mutex_);
  listener_ = std::move(listener);
}

void Spool::notify() const {
  const std::lock_guard lock(listener_mutex_);
  if (listener_) listener_();
}

Result<void> Spool::acknowledge_file(const std::string& scan_id, const std::string& name, const std::string& sha256) {
  const std::lock_guard lock(mutex_);
  const Result<Entry*> entry = find(scan_id);
  if (!entry) return tl::unexpected(entry.error());
  const SpooledFile* known = find_file((*entry)->scan.files, name);
  // An acknowledgement of content that was replaced or discarded meanwhile says nothing about the scan as it is now.
  if (!known || known->phase != SpooledFilePhase::spooled || known->sha256 != sha256) return {};
  return (*entry)->record(event_named(Kind::stored, name));
}

Result<void> Spool::unacknowledge_file(const std::string& scan_id, const std::string& name) {
  return record(scan_id, event_named(Kind::lost, name));
}

Result<void> Spool::acknowledge_scan(const std::string& scan_id) {
  if (phase(scan_id) == SpoolPhase::acknowledged) return {};
  return record(scan_id, event_named(Kind::acknowledged));
}

Result<void> Spool::fail_scan(const std::string& scan_id, const std::string& reason) {
  if (phase(scan_id) == SpoolPhase::failed) return {};
  return record(scan_id, {.kind = Kind::failed, .name = {}, .size = 0, .sha256 = {}, .reason = reason});
}

Result<void> Spool::add_result(const std::string& scan_id, const SpooledFile& result, const fs::path& from) {
  if (Result<void> synced = sync_path(from); !synced) return synced;
  if (Result<void> renamed = rename_durably(from, bundle(scan_id).root() / result.name); !renamed) return renamed;
  return record(
      scan_id, {.kind = Kind::result, .name = result.name, .size = result.size, .sha256 = result.sha256, .reason = {}});
}

Result<void> Spool::deliver_scan(const std::string& scan_id) {
  return record(scan_id, event_named(Kind::delivered));
}

}  // namespace gyre
