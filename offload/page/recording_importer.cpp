// SPDX-License-Identifier: Apache-2.0
#include "offload/page/recording_importer.h"

#include "common/bundle/atomic_file.h"
#include "common/bundle/sha256.h"

#include <algorithm>

namespace gyre {

namespace {

namespace fs = std::filesystem;

constexpr const char* device_name = "recording";

Scan scan_of(const Upload& upload) {
  Scan scan;
  scan.id = upload.id;
  scan.created = upload.created;
  scan.device = device_name;
  scan.software = GYRE_VERSION;
  scan.height_mm = upload.height_mm;
  return scan;
}

}  // namespace

void RecordingImporter::start() {
  for (const Upload& upload : desk_.finished(true)) {
    if (const Result<void> added = add(upload.id); !added)
      spdlog::error("upload {}: {}", upload.id, added.error().message());
  }
  thread_ = std::thread([this] { run(); });
}

void RecordingImporter::stop() {
  {
    const std::scoped_lock lock(mutex_);
    stopping_ = true;
    cancelled_ = true;
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

Result<void> RecordingImporter::add(const std::string& id) {
  std::vector<Upload> uploads = desk_.finished(false);
  const auto upload = std::find_if(uploads.begin(), uploads.end(), [&](const Upload& u) { return u.id == id; });
  if (upload == uploads.end()) return wrong_use("there is no such upload", id, "begin again");
  // No device has the empty key, so that none can touch the scan.
  if (const Result<void> opened = store_.open_scan(scan_of(*upload), "", device_name); !opened) return opened;
  const std::scoped_lock lock(mutex_);
  waiting_.push_back(std::move(*upload));
  changed_.notify_all();
  return {};
}

std::optional<ScanActivity> RecordingImporter::work(const std::string& id) const {
  const std::scoped_lock lock(mutex_);
  if (id == current_) return work_;
  const auto same = [&](const Upload& upload) { return upload.id == id; };
  if (std::any_of(waiting_.begin(), waiting_.end(), same)) return ScanActivity{"keyframes", 0.0, "waiting"};
  return std::nullopt;
}

void RecordingImporter::drop(const std::string& id) {
  std::unique_lock lock(mutex_);
  std::erase_if(waiting_, [&](const Upload& upload) { return upload.id == id; });
  if (id == current_) cancelled_ = true;
  changed_.wait(lock, [&] { return id != current_; });
  desk_.remove(id);
}

void RecordingImporter::run() {
  for (;;) {
    Upload upload;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return stopping_ || !waiting_.empty(); });
      if (stopping_) return;
      upload = std::move(waiting_.front());
      waiting_.pop_front();
      current_ = upload.id;
      work_ = {"keyframes", 0.0, ""};
      cancelled_ = false;
    }
    import(upload);
    const std::scoped_lock lock(mutex_);
    current_.clear();
    changed_.notify_all();
  }
}

void RecordingImporter::import(const Upload& upload) {
  const Result<void> done = bring_in(upload);
  if (cancelled_) return;  // it starts over, or has been dropped
  if (!done) {
    spdlog::error("scan {}: {}", upload.id, done.error().message());
    if (const Result<void> failed = store_.fail_job(upload.id, done.error().message()); !failed) {
      spdlog::error("scan {}: {}", upload.id, failed.error().message());
    }
  }
  desk_.remove(upload.id);
  if (done) on_queued_(upload.id);
}

Result<void> RecordingImporter::bring_in(const Upload& upload) {
  const Result<std::optional<StoredScan>> known = store_.scan(upload.id);
  if (!known) return tl::unexpected(known.error());
  if (!*known || (*known)->phase != StorePhase::receiving) return {};  // a crash came after its job was queued
  const auto progress = [&](double fraction, std::string_view what) {
    const std::scoped_lock lock(mutex_);
    work_ = {"keyframes", fraction, std::string(what)};
  };
  const Bundle bundle = store_.bundle(upload.id);
  const Result<Scan> scan = scan_of_recordings(upload.recordings, bundle, scan_of(upload), progress, cancelled_);
  if (!scan) return tl::unexpected(scan.error());
  if (const Result<void> sound = verify_bundle(bundle); !sound) return sound;

  std::vector<std::string> names = {"scan.json", "frames.jsonl"};
  const Result<std::vector<FrameId>> frames = list_frames(bundle);
  if (!frames) return tl::unexpected(frames.error());
  for (const FrameId& frame : *frames) names.push_back("frames/" + frame_name(frame.pass, frame.index));
  for (const std::string& name : names) {
    const fs::path file = bundle.root() / name;
    const Result<std::string> hash = sha256_of_file(file);
    if (!hash) return tl::unexpected(hash.error());
    std::error_code error;
    if (const Result<void> added = store_.add_file(upload.id, {name, fs::file_size(file, error), *hash}); !added) {
      return added;
    }
  }
  return store_.queue_job(upload.id);
}

}  // namespace gyre
