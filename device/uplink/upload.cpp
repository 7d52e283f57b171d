// SPDX-License-Identifier: Apache-2.0
#include "device/uplink/upload.h"

#include "common/bundle/atomic_file.h"
#include "common/bundle/sha256.h"

#include <algorithm>

namespace gyre {

namespace {

using Next = std::optional<wire::Message>;

// A host that answers ScanClose with the same gap again and again is at odds with itself.
constexpr int max_closes = 5;

tl::unexpected<Error> damaged(const std::filesystem::path& file) {
  return fail("a spooled file is damaged on this device", file.string(),
              "check its disk; the scan cannot be completed");
}

bool is_dropped(const SpooledFile& file) {
  return file.phase == SpooledFilePhase::discarded;
}

}  // namespace

Result<Next> Upload::next(Time now) {
  offer_refused_again(now);
  if (!stale_ && !current_) return Next();
  if (stale_) {
    // Something smaller than a chunk may have become due, or the current file may have been dropped.
    if (current_) {
      const std::optional<SpooledScan> scan = spool_.scan(current_->scan);
      const SpooledFile* file = scan ? find_file(scan->files, current_->file.name) : nullptr;
      if (!file || is_dropped(*file) || file->sha256 != current_->file.sha256) current_.reset();
    }
    for (const std::string& id : spool_.scan_ids()) {
      Result<Next> message = next_of(id, scans_[id]);
      if (!message || *message) return message;
    }
    stale_ = false;
  }
  return next_chunk(now);
}

void Upload::offer_refused_again(Time now) {
  for (auto it = refused_.begin(); it != refused_.end();) {
    if (now < it->second) {
      ++it;
      continue;
    }
    scans_.erase(it->first);
    stale_ = true;
    it = refused_.erase(it);
  }
}

// Small messages of a scan first, then the choice of the next file; nothing when only chunks of a file are left to
// send.
Result<Next> Upload::next_of(const std::string& id, Scan& scan) {
  if (scan.over || (scan.open_sent && !scan.host_known)) return Next();
  const std::optional<SpooledScan> now = spool_.scan(id);
  scan.over = !now || now->phase == SpoolPhase::delivered;
  if (scan.over) return Next();
  if (!scan.open_sent) {
    Result<std::string> description = read_file(spool_.bundle(id).scan_file());
    if (!description) return tl::unexpected(description.error());
    scan.open_sent = true;
    return Next(wire::ScanOpen{id, std::move(*description)});
  }
  bool all_stored = true;
  for (const SpooledFile& file : now->files) {
    if (is_dropped(file)) {
      scan.sent.erase(file.name);
      scan.held.erase(file.name);
      if (scan.at_host.erase(file.name) > 0) return Next(wire::Discard{id, file.name});
      continue;
    }
    if (file.phase == SpooledFilePhase::acknowledged) continue;
    all_stored = false;
    const auto sent = scan.sent.find(file.name);
    if (current_ || (sent != scan.sent.end() && sent->second == file.sha256)) continue;
    if (Result<void> started = start(id, scan, file); !started) return tl::unexpected(started.error());
  }
  if (now->phase != SpoolPhase::closed || !all_stored || scan.close_sent) return Next();
  scan.close_sent = true;
  wire::ScanClose close{id, {}};
  for (const SpooledFile& file : now->files) {
    if (!is_dropped(file)) close.files.push_back({file.name, file.size, file.sha256});
  }
  return Next(std::move(close));
}

Result<void> Upload::start(const std::string& id, Scan& scan, const SpooledFile& file) {
  const std::filesystem::path path = spool_.bundle(id).root() / file.name;
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  bool whole = !error && size == file.size;
  if (whole && scan.resumed.contains(file.name)) {
    const Result<std::string> hash = sha256_of_file(path);
    whole = hash && *hash == file.sha256;
  }
  std::ifstream content(path, std::ios::binary);
  if (!whole || !content) return damaged(path);
  const auto held = scan.held.find(file.name);
  const bool resume = held != scan.held.end() && held->second.file.sha256 == file.sha256;
  std::uint64_t offset = resume ? std::min(held->second.held, file.size) : 0;
  // The host has every byte but has not checked them: the last chunk again makes it do so.
  if (offset == file.size) offset -= std::min<std::uint64_t>(offset, wire::max_chunk_bytes);
  scan.at_host.insert(file.name);
  content.seekg(static_cast<std::streamoff>(offset));
  current_ = Current{id, file, std::move(content), offset};
  return {};
}

Result<Next> Upload::next_chunk(Time now) {
  if (!current_) return Next();
  const SpooledFile& file = current_->file;
  const std::uint64_t size = std::min<std::uint64_t>(file.size - current_->offset, wire::max_chunk_bytes);
  if (!pacer_.may_send(wire::cost_of(size), now)) return Next();
  pacer_.sent(wire::cost_of(size), now);
  wire::FileChunk chunk{current_->scan, {file.name, file.size, file.sha256}, current_->offset, std::string(size, '\0')};
  if (!current_->content.read(chunk.data.data(), static_cast<std::streamsize>(size))) {
    return damaged(spool_.bundle(current_->scan).root() / file.name);
  }
  current_->offset += size;
  if (current_->offset == file.size) {
    scans_[current_->scan].sent[file.name] = file.sha256;
    current_.reset();
    stale_ = true;
  }
  return Next(std::move(chunk));
}

std::chrono::milliseconds Upload::wait(Time now) const {
  return current_ ? pacer_.wait(now) : std::chrono::milliseconds(0);
}

Result<void> Upload::on(const wire::ScanState& state, Time when) {
  const std::optional<SpooledScan> now = spool_.scan(state.scan);
  if (!now || now->phase == SpoolPhase::delivered) return {};
  Scan& scan = scans_[state.scan];
  stale_ = true;
  scan.host_known = true;
  switch (state.phase) {
    case wire::ScanPhase::receiving:
      break;
    case wire::ScanPhase::queued:
    case wire::ScanPhase::running:
    case wire::ScanPhase::done:
      scan.over = true;
      return spool_.acknowledge_scan(state.scan);
    case wire::ScanPhase::failed:
      scan.over = true;
      return spool_.fail_scan(state.scan, state.text);
    case wire::ScanPhase::refused:
      scan.over = true;
      refused_[state.scan] = when + refused_retry_;
      return {};
  }
  if (std::exchange(scan.close_sent, false) && ++scan.closes >= max_closes) {
    return fail("the host keeps missing files of a scan", state.scan, "look at its log");
  }
  scan.sent.clear();
  scan.held.clear();
  for (const wire::HeldFile& held : state.files) {
    scan.at_host.insert(held.file.name);
    if (!held.stored) scan.held[held.file.name] = held;
  }
  if (Result<void> done = host_lacks_files(*now, state); !done) return done;
  for (const wire::HeldFile& held : state.files) {
    if (!held.stored) continue;
    Result<void> done = spool_.acknowledge_file(state.scan, held.file.name, held.file.sha256);
    if (!done) return done;
  }
  return {};
}

// Takes back every acknowledgement the host does not stand by, as after it lost its disk.
Result<void> Upload::host_lacks_files(const SpooledScan& scan, const wire::ScanState& state) {
  // A host still receiving a scan it had acknowledged has lost that too; any one file sends the scan back to closed.
  bool reopen = scan.phase == SpoolPhase::acknowledged || scan.phase == SpoolPhase::failed;
  for (const SpooledFile& file : scan.files) {
    if (file.phase != SpooledFilePhase::acknowledged) continue;
    const bool stored = std::any_of(state.files.begin(), state.files.end(), [&](const wire::HeldFile& held) {
      return held.stored && held.file.name == file.name && held.file.sha256 == file.sha256;
    });
    if (stored && !reopen) continue;
    reopen = false;
    if (Result<void> done = spool_.unacknowledge_file(scan.id, file.name); !done) return done;
  }
  return {};
}

Result<void> Upload::on(const wire::FileAck& ack) {
  stale_ = true;
  return spool_.acknowledge_file(ack.scan, ack.name, ack.sha256);
}

Result<void> Upload::on(const wire::FileResume& resume) {
  stale_ = true;
  Scan& scan = scans_[resume.scan];
  scan.resumed.insert(resume.name);
  scan.sent.erase(resume.name);
  scan.held[resume.name] = {{resume.name, resume.offset, resume.sha256}, resume.offset, false};
  if (current_ && current_->scan == resume.scan && current_->file.name == resume.name) current_.reset();
  return {};
}

}  // namespace gyre
