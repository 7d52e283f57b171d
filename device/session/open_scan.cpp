// SPDX-License-Identifier: Apache-2.0
#include "device/session/open_scan.h"

#include "common/bundle/ulid.h"
#include "common/log/utc_time.h"

#include <spdlog/spdlog.h>
#include <algorithm>
#include <iterator>
#include <memory>
#include <utility>

namespace gyre {

namespace {

constexpr std::size_t writes_waiting = 6;  // pictures in memory until a slow card has taken them

std::vector<std::string> passes_of(const std::string& mode) {
  if (mode == "turn") return {"turn"};
  return {"body", "head"};
}

}  // namespace

OpenScan::OpenScan(Spool& spool, const std::filesystem::path& folder, OpenScanOptions options)
    : spool_(spool),
      store_(folder),
      options_(std::move(options)),
      passes_(passes_of(options_.mode)),
      pass_(passes_.front()),
      writer_(writes_waiting) {}

SessionState OpenScan::restore() {
  store_.tidy();
  std::optional<StoredSession> stored = store_.load();
  if (!stored) return SessionState::idle;
  scan_ = std::move(stored->scan);
  current_.reset();
  if (scan_ && !scan_->passes.empty() && scan_->passes.back().name == stored->pass) {
    current_ = scan_->passes.back();
    scan_->passes.pop_back();
  }
  if (scan_) passes_ = passes_of(scan_->mode);
  const bool is_known = std::find(passes_.begin(), passes_.end(), stored->pass) != passes_.end();
  pass_ = is_known ? stored->pass : passes_.front();
  return stored->state;
}

Result<void> OpenScan::save(SessionState state) const {
  StoredSession session{state, scan_, pass_};
  if (session.scan && current_) session.scan->passes.push_back(*current_);
  return store_.save(session);
}

// Files of the pass that are in the spool.
std::vector<SpooledFile> OpenScan::spooled() const {
  std::vector<SpooledFile> files;
  const std::optional<SpooledScan> scan = scan_ ? spool_.scan(scan_->id) : std::nullopt;
  if (!scan || scan->phase != SpoolPhase::recording) return files;
  for (const SpooledFile& file : scan->files) {
    const std::optional<FrameId> id = parse_frame_name(std::filesystem::path(file.name).filename().string());
    if (id && id->pass == pass_ && file.phase != SpooledFilePhase::discarded) files.push_back(file);
  }
  return files;
}

SessionFacts OpenScan::facts() const {
  SessionFacts facts;
  facts.has_pass = scan_ && !scan_->passes.empty();
  const bool is_closed = scan_ && std::any_of(scan_->passes.begin(), scan_->passes.end(),
                                              [&](const ScanPass& pass) { return pass.name == pass_; });
  facts.has_cut_pass = !recorder_ && !is_closed && !spooled().empty();
  facts.has_next = !scan_ || scan_->passes.size() < passes_.size();
  return facts;
}

bool OpenScan::is_last_pass() const {
  return pass_ == passes_.back();
}

void OpenScan::begin(const std::optional<double>& height_mm) {
  const std::optional<SpoolPhase> phase = scan_ ? spool_.phase(scan_->id) : std::nullopt;
  const bool is_open = scan_ && (!phase || *phase == SpoolPhase::recording);
  if (is_open && !scan_->passes.empty()) return;
  Scan scan;
  scan.id = is_open ? scan_->id : new_ulid();
  scan.mode = options_.mode;
  scan.device = options_.device;
  scan.created = utc_now();
  scan.software = GYRE_VERSION;
  scan.height_mm = height_mm;
  scan.camera = options_.camera;
  scan_ = std::move(scan);
  store_.forget_records();  // of another one
  passes_ = passes_of(options_.mode);
  pass_ = passes_.front();
  current_.reset();
}

void OpenScan::start_pass(const CameraInfo& camera) {
  current_ = ScanPass{pass_, camera.fps, camera.expected_frames, camera.width, camera.height, camera.focal_35mm};
  Scan scan = *scan_;
  scan.passes.push_back(*current_);
  recorder_.emplace(spool_, std::move(scan), pass_, camera, options_.recorder);
}

void OpenScan::add(Frame frame, std::optional<double> turntable) {
  PassRecorder& recorder = *recorder_;
  PassRecorder::Picked picked = recorder.add(std::move(frame), turntable);
  if (picked.likely) {
    writer_.put([&recorder, likely = std::move(*picked.likely)] { return recorder.keep(likely); });
  }
  if (picked.spare) {
    writer_.put([&recorder, spare = std::move(*picked.spare)] { return recorder.remember(spare); });
  }
}

// A pass is closed: its records first, so that a scan never names one without.
Result<void> OpenScan::passed(const ScanPass& pass, const std::vector<FrameRecord>& records) {
  if (const Result<void> saved = store_.save_records(scan_->id, pass.name, records); !saved) return saved;
  scan_->passes.push_back(pass);
  current_.reset();
  const auto done = std::find(passes_.begin(), passes_.end(), pass.name);
  if (done != passes_.end() && std::next(done) != passes_.end()) pass_ = *std::next(done);
  return {};
}

Result<ClosedPass> OpenScan::close_pass(const Recall& recall) {
  if (const Result<void> written = writer_.drain(); !written) spdlog::warn("{}", written.error().message());
  const Result<Selection> selection = recorder_->decide();
  if (!selection) return ClosedPass{false, selection.error().message(), 0};
  RecordingSummary summary;
  const Result<std::vector<FrameRecord>> records = recorder_->finish(*selection, recall, summary);
  const ScanPass pass = recorder_->pass();
  recorder_.reset();
  if (!records) return tl::unexpected(records.error());
  if (const Result<void> done = passed(pass, *records); !done) return tl::unexpected(done.error());
  std::string text = "pass " + pass.name + ": " + std::to_string(summary.keyframes) + " keyframes of " +
                     std::to_string(summary.frames) + " frames";
  if (summary.unsharp_sectors > 0) {
    text += "; " + std::to_string(summary.unsharp_sectors) + " sectors without a sharp picture";
  }
  return ClosedPass{true, text, summary.keyframes};
}

Result<void> OpenScan::drop_pass() {
  (void)writer_.drain();  // what it could not write is dropped anyway
  recorder_.reset();
  current_.reset();
  for (const SpooledFile& file : spooled()) {
    if (const Result<void> taken = spool_.discard(scan_->id, file.name); !taken) return taken;
  }
  return {};
}

// Lines for what is in the spool, for want of the measurements.
Result<std::vector<FrameRecord>> OpenScan::records_in_spool(const std::string& pass) const {
  std::vector<FrameRecord> records;
  const std::optional<SpooledScan> scan = spool_.scan(scan_->id);
  if (!scan) return fail("the scan is gone from the spool", scan_->id);
  const double fps = current_ && current_->name == pass ? current_->fps : 0.0;
  for (const SpooledFile& file : scan->files) {
    const std::optional<FrameId> id = parse_frame_name(std::filesystem::path(file.name).filename().string());
    if (!id || id->pass != pass || file.phase == SpooledFilePhase::discarded) continue;
    FrameRecord record;
    record.pass = pass;
    record.index = id->index;
    record.time = fps > 0.0 ? id->index / fps : id->index;
    record.decision = "keyframe";
    record.reason = "Kept: the recording was cut off before its keyframes were decided.";
    records.push_back(std::move(record));
  }
  return records;
}

Result<ClosedPass> OpenScan::recover_pass() {
  const Result<std::vector<FrameRecord>> records = records_in_spool(pass_);
  if (!records) return tl::unexpected(records.error());
  const int keyframes = static_cast<int>(records->size());
  const std::string what = "scan " + scan_->id + ": its pass " + pass_ + " was cut off";
  if (keyframes < least_frames || !current_) {
    if (const Result<void> dropped = drop_pass(); !dropped) return tl::unexpected(dropped.error());
    return ClosedPass{false, what + " with " + std::to_string(keyframes) + " keyframes, too few to be of use", 0};
  }
  ScanPass pass = *current_;
  pass.frame_count = records->back().index + 1;
  if (const Result<void> done = passed(pass, *records); !done) return tl::unexpected(done.error());
  return ClosedPass{true, what + " and keeps its " + std::to_string(keyframes) + " keyframes", keyframes};
}

Result<void> OpenScan::close_scan() {
  std::vector<FrameRecord> records;
  for (const ScanPass& pass : scan_->passes) {
    Result<std::vector<FrameRecord>> some = store_.load_records(scan_->id, pass.name);
    if (!some) {
      spdlog::warn("{}; what is in the spool counts", some.error().message());
      some = records_in_spool(pass.name);
    }
    if (!some) return tl::unexpected(some.error());
    records.insert(records.end(), std::make_move_iterator(some->begin()), std::make_move_iterator(some->end()));
  }
  return spool_.close_scan(*scan_, records);
}

void OpenScan::forget() {
  store_.forget_records();
  current_.reset();
  passes_ = passes_of(options_.mode);
  pass_ = passes_.front();
  const std::optional<SpoolPhase> phase = scan_ ? spool_.phase(scan_->id) : std::nullopt;
  const bool is_empty = phase == SpoolPhase::recording && scan_->passes.empty() && spooled().empty();
  if (!is_empty) scan_.reset();
}

}  // namespace gyre
