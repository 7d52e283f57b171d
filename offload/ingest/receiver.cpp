// SPDX-License-Identifier: Apache-2.0
#include "offload/ingest/receiver.h"

#include "common/bundle/atomic_file.h"
#include "common/bundle/bundle.h"
#include "common/bundle/sha256.h"

#include <spdlog/spdlog.h>
#include <algorithm>
#include <map>
#include <system_error>

namespace gyre {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view frames_folder = "frames/";
constexpr std::string_view part_suffix = ".part";
constexpr std::size_t hash_length = 64;

wire::FileEntry entry_of(const StoredFile& file) {
  return {file.name, file.size, file.sha256};
}

std::uint64_t size_or_zero(const fs::path& file) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(file, error);
  return error ? 0 : size;
}

bool is_whole(const fs::path& file, std::uint64_t size) {
  std::error_code error;
  return fs::is_regular_file(file, error) && size_or_zero(file) == size;
}

// The files half received, as their names and what is there of them.
std::vector<wire::HeldFile> parts_in(const fs::path& folder) {
  std::vector<wire::HeldFile> parts;
  std::error_code error;
  for (auto it = fs::directory_iterator(folder, error); !error && it != fs::directory_iterator(); it.increment(error)) {
    const std::string file = it->path().filename().string();
    constexpr std::size_t tail = 1 + hash_length + part_suffix.size();
    if (file.size() <= tail || !file.ends_with(part_suffix)) continue;
    const std::string base = file.substr(0, file.size() - tail);
    const std::string name = wire::is_bundle_file(base) ? base : std::string(frames_folder) + base;
    const std::uint64_t held = size_or_zero(it->path());
    if (wire::is_bundle_file(name)) {
      parts.push_back({{name, held, file.substr(base.size() + 1, hash_length)}, held, false});
    }
  }
  std::sort(parts.begin(), parts.end(), [](const auto& a, const auto& b) { return a.file.name < b.file.name; });
  return parts;
}

wire::ScanPhase wire_phase(StorePhase phase) {
  switch (phase) {
    case StorePhase::receiving:
      return wire::ScanPhase::receiving;
    case StorePhase::queued:
      return wire::ScanPhase::queued;
    case StorePhase::running:
      return wire::ScanPhase::running;
    case StorePhase::done:
      return wire::ScanPhase::done;
    case StorePhase::failed:
      break;
  }
  return wire::ScanPhase::failed;
}

}  // namespace

fs::path Receiver::part_of(const std::string& scan_id, const std::string& name, const std::string& sha256) const {
  const std::string base = name.starts_with(frames_folder) ? name.substr(frames_folder.size()) : name;
  return store_.incoming(scan_id) / (base + "." + sha256 + std::string(part_suffix));
}

Receiver::Receiver(Store& store, std::uint64_t max_file_bytes, LinkCounts& counts, std::function<void()> on_finished)
    : store_(store),
      max_file_bytes_(max_file_bytes),
      counts_(counts),
      finisher_(
          {.waiting = 32}, [&store](std::vector<ArrivedFile> files) { return finish_files(store, std::move(files)); },
          on_finished),
      checker_(
          {.at_once = 1},
          [&store](std::vector<std::string> scans) {
            std::vector<CheckedBundle> checked;
            for (std::string& scan : scans) {
              Result<void> good = verify_bundle(store.bundle(scan));
              checked.push_back({std::move(scan), std::move(good)});
            }
            return checked;
          },
          std::move(on_finished)) {}

Result<wire::ScanState> Receiver::state(const std::string& scan_id) {
  const Result<std::optional<StoredScan>> scan = store_.scan(scan_id);
  if (!scan) return tl::unexpected(scan.error());
  if (!*scan) return wire::ScanState{scan_id, wire::ScanPhase::refused, "it was deleted on the host", {}};
  std::erase_if(resuming_, [&](const fs::path& part) { return part.parent_path() == store_.incoming(scan_id); });
  wire::ScanState state{scan_id, wire_phase((*scan)->phase), (*scan)->reason, {}};
  if (state.phase != wire::ScanPhase::receiving) return state;
  const Result<std::vector<StoredFile>> files = store_.files(scan_id);
  if (!files) return tl::unexpected(files.error());
  for (const StoredFile& file : *files) {
    if (is_whole(store_.bundle(scan_id).root() / file.name, file.size)) {
      state.files.push_back({entry_of(file), file.size, true});
    } else if (Result<void> removed = store_.remove_file(scan_id, file.name); !removed) {
      return tl::unexpected(removed.error());
    }
  }
  for (wire::HeldFile& part : parts_in(store_.incoming(scan_id))) {
    if (state.files.size() < wire::max_files) state.files.push_back(std::move(part));
  }
  return state;
}

// The answer to a chunk that is not written, if it is not: its file is here, or its scan takes no files. While a scan
// is checked there is none: the check's outcome is the answer.
Result<std::optional<wire::Message>> Receiver::answer_unwritten(const wire::FileChunk& chunk, bool& wanted) {
  using Answer = std::optional<wire::Message>;
  wanted = false;
  const Result<std::optional<StoredScan>> scan = store_.scan(chunk.scan);
  if (!scan) return tl::unexpected(scan.error());
  const Result<std::optional<StoredFile>> stored = store_.file(chunk.scan, chunk.file.name);
  if (!stored) return tl::unexpected(stored.error());
  if (*stored && (*stored)->sha256 == chunk.file.sha256) {
    if (chunk.offset + chunk.data.size() < chunk.file.size) return Answer();
    return Answer(wire::FileAck{chunk.scan, chunk.file.name, chunk.file.sha256});
  }
  if (!*scan || (*scan)->phase != StorePhase::receiving) {
    Result<wire::ScanState> now = state(chunk.scan);
    if (!now) return tl::unexpected(now.error());
    return Answer(std::move(*now));
  }
  wanted = !checking_.contains(chunk.scan);
  return Answer();
}

Result<std::optional<wire::Message>> Receiver::accept(const wire::FileChunk& chunk) {
  using Answer = std::optional<wire::Message>;
  const std::uint64_t end = chunk.offset + chunk.data.size();
  counts_.received_bytes += chunk.data.size();
  if (chunk.file.size > max_file_bytes_) return fail("a file is larger than the host takes", chunk.file.name);
  const fs::path part = part_of(chunk.scan, chunk.file.name, chunk.file.sha256);
  if (finishing_.contains(part)) return Answer();  // sent twice
  // The catalogue is asked at the first chunk of a file and at the last.
  const std::optional<std::uint64_t> open = parts_.held(part);
  if (!open || end >= chunk.file.size) {
    bool wanted = false;
    Result<Answer> answer = answer_unwritten(chunk, wanted);
    if (!answer || !wanted) return answer;
  }
  const std::uint64_t held = open ? *open : size_or_zero(part);
  if (chunk.offset > held) {
    if (!resuming_.insert(part).second) return Answer();
    ++counts_.resumed_files;
    return Answer(wire::FileResume{chunk.scan, chunk.file.name, chunk.file.sha256, held});
  }
  resuming_.erase(part);
  if (end > held || chunk.file.size == 0) {
    if (const Result<std::uint64_t> opened = parts_.open(part); !opened) return tl::unexpected(opened.error());
    if (Result<void> written = parts_.write(part, chunk.offset, chunk.data); !written) {
      return tl::unexpected(written.error());
    }
  }
  if (std::max(end, held) < chunk.file.size) return Answer();
  parts_.hand_over(part);
  finishing_.insert(part);
  finisher_.add({chunk.scan, chunk.file, part});
  return Answer();
}

std::vector<Receiver::Finished> Receiver::finished() {
  std::vector<Finished> all;
  for (const FinishedFile& one : finisher_.take()) {
    const auto& [scan, file, part] = one.arrived;
    finishing_.erase(part);
    if (!one.stored) {
      all.push_back({scan, tl::unexpected(one.stored.error())});
      continue;
    }
    if (!*one.stored) {
      ++counts_.damaged_files;
      spdlog::warn("scan {}: {} arrived damaged and is fetched again", scan, file.name);
      resuming_.insert(part);
      all.push_back({scan, wire::FileResume{scan, file.name, file.sha256, 0}});
      continue;
    }
    ++counts_.received_files;
    if (file.name.starts_with(frames_folder)) ++counts_.received_frames;
    all.push_back({scan, wire::FileAck{scan, file.name, file.sha256}});
  }
  for (const CheckedBundle& checked : checker_.take()) all.push_back(conclude(checked));
  return all;
}

Receiver::Finished Receiver::conclude(const CheckedBundle& checked) {
  const auto& [scan, good] = checked;
  checking_.erase(scan);
  const Result<std::optional<StoredScan>> known = store_.scan(scan);
  if (!known) return {scan, tl::unexpected(known.error())};
  const bool was_deleted = !*known;
  if (!was_deleted) {
    if (!good) spdlog::error("scan {} is not a usable bundle: {}", scan, good.error().message());
    const Result<void> noted = good ? store_.queue_job(scan) : store_.fail_job(scan, good.error().message());
    if (!noted) return {scan, tl::unexpected(noted.error())};
  }
  std::error_code error;
  fs::remove_all(store_.incoming(scan), error);
  Result<wire::ScanState> now = state(scan);
  if (!now) return {scan, tl::unexpected(now.error()), good.has_value() && !was_deleted};
  return {scan, std::move(*now), good.has_value() && !was_deleted};
}

void Receiver::wait_for(const std::string& scan_id) {
  const fs::path folder = store_.incoming(scan_id);
  const bool busy = std::any_of(finishing_.begin(), finishing_.end(),
                                [&](const fs::path& part) { return part.parent_path() == folder; });
  if (busy) finisher_.wait();
}

Result<void> Receiver::discard(const wire::Discard& discard) {
  const Result<std::optional<StoredScan>> scan = store_.scan(discard.scan);
  if (!scan) return tl::unexpected(scan.error());
  if (!*scan || (*scan)->phase != StorePhase::receiving || !wire::is_bundle_file(discard.name)) return {};
  if (checking_.contains(discard.scan)) return {};
  if (Result<void> removed = store_.remove_file(discard.scan, discard.name); !removed) return removed;
  std::error_code error;
  fs::remove(store_.bundle(discard.scan).root() / discard.name, error);
  for (const wire::HeldFile& part : parts_in(store_.incoming(discard.scan))) {
    if (part.file.name == discard.name) fs::remove(part_of(discard.scan, discard.name, part.file.sha256), error);
  }
  return {};
}

Result<std::optional<wire::ScanState>> Receiver::close(const wire::ScanClose& manifest) {
  using Answer = std::optional<wire::ScanState>;
  if (checking_.contains(manifest.scan)) return Answer();
  Result<wire::ScanState> now = state(manifest.scan);
  if (!now) return tl::unexpected(now.error());
  if (now->phase != wire::ScanPhase::receiving) return Answer(std::move(*now));
  std::map<std::string, std::string> stored;  // name to hash
  for (const wire::HeldFile& held : now->files) {
    if (held.stored) stored[held.file.name] = held.file.sha256;
  }
  for (const wire::FileEntry& file : manifest.files) {
    const auto found = stored.find(file.name);
    if (found == stored.end() || found->second != file.sha256) return Answer(std::move(*now));
  }
  if (Result<void> removed = remove_unlisted(manifest); !removed) return tl::unexpected(removed.error());
  checking_.insert(manifest.scan);
  checker_.add(manifest.scan);
  return Answer();
}

// Takes what the manifest does not name out of the catalogue and off the disk, files that a crash kept from being
// catalogued included.
Result<void> Receiver::remove_unlisted(const wire::ScanClose& manifest) {
  std::set<std::string> listed;
  for (const wire::FileEntry& file : manifest.files) listed.insert(file.name);
  const Result<std::vector<StoredFile>> files = store_.files(manifest.scan);
  if (!files) return tl::unexpected(files.error());
  for (const StoredFile& file : *files) {
    if (listed.contains(file.name)) continue;
    if (Result<void> removed = store_.remove_file(manifest.scan, file.name); !removed) return removed;
  }
  const Bundle bundle = store_.bundle(manifest.scan);
  std::error_code error;
  std::vector<fs::path> unlisted;
  for (auto it = fs::directory_iterator(bundle.frames(), error); !error && it != fs::directory_iterator();
       it.increment(error)) {
    if (!listed.contains(std::string(frames_folder) + it->path().filename().string())) unlisted.push_back(it->path());
  }
  for (const fs::path& file : unlisted) fs::remove(file, error);
  if (error)
    return fail("cannot clean up the frames of a scan", bundle.frames().string() + " (" + error.message() + ")");
  return {};
}

}  // namespace gyre
