// SPDX-License-Identifier: Apache-2.0
#include "device/session/session.h"

#include "common/selection/ingest.h"
#include "device/analysis/pass_analysis.h"
#include "device/coverage/coverage.h"

#include <algorithm>
#include <set>

namespace gyre {

namespace {

constexpr std::chrono::milliseconds frame_timeout{1000};
constexpr int silent_timeouts = 10;  // in a row, then the camera counts as lost

std::string file_of(const std::string& pass, int index) {
  return "frames/" + frame_name(pass, index);
}

// Records one pass of a scan.
class PassRecorder {
 public:
  PassRecorder(Spool& spool, const Scan& scan, const PassPlan& plan)
      : spool_(spool),
        scan_(scan),
        name_(plan.name),
        camera_(*plan.camera),
        analysis_(plan.name, camera_.info()),
        coverage_(plan.name, lens_of(camera_.info())) {}

  Result<void> record(const Progress& progress) {
    if (const Result<void> started = camera_.start(); !started) return started;
    const Result<void> recorded = follow(progress);
    camera_.stop();
    return recorded;
  }

  // Makes the pass in the spool what the exact rule says.
  Result<std::vector<FrameRecord>> finish(RecordingSummary& summary) {
    Result<Selection> selection = analysis_.finish();
    if (!selection) {
      if (selection.error().kind == Error::Kind::failed) {
        selection.error().where = "pass " + name_ + " (" + camera_.info().name + "), " + selection.error().where;
      }
      return tl::unexpected(selection.error());
    }
    const std::set<int> keyframes(selection->keyframes.begin(), selection->keyframes.end());
    const Result<std::set<int>> there = settle(keyframes, summary);
    if (!there) return tl::unexpected(there.error());

    std::vector<int> missing;
    std::set_difference(keyframes.begin(), keyframes.end(), there->begin(), there->end(), std::back_inserter(missing));
    const Result<void> recalled = camera_.recall(missing, [&](const Frame& frame) { return add(frame); });
    if (!recalled) return tl::unexpected(recalled.error());

    summary.frames += static_cast<int>(analysis_.frames().size());
    summary.keyframes += static_cast<int>(keyframes.size());
    std::vector<FrameRecord> records = frame_records(name_, analysis_.frames(), *selection);
    for (std::size_t i = 0; i < azimuths_.size(); ++i) records[i].azimuth = azimuths_[i];
    return records;
  }

  ScanPass pass() const {
    const CameraInfo& camera = camera_.info();
    const auto frames = static_cast<int>(analysis_.frames().size());
    return {name_, camera.fps, frames, camera.width, camera.height, camera.focal_35mm};
  }

 private:
  Result<void> follow(const Progress& progress) {
    int silent = 0;
    for (;;) {
      Result<CameraEvent> event = camera_.next(frame_timeout);
      if (!event) return tl::unexpected(event.error());
      if (event->kind == CameraEvent::Kind::ended) return {};
      if (event->kind == CameraEvent::Kind::timeout) {
        if (event->recovering || ++silent < silent_timeouts) continue;
        return fail("the camera is silent", camera_.info().name, "check its connection and run again");
      }
      silent = 0;
      const std::optional<Frame> proposed = analysis_.add(std::move(*event->frame));
      locate();
      if (proposed) {
        if (const Result<void> added = add(*proposed); !added) return added;
      }
      if (const int expected = camera_.info().expected_frames; expected > 0) {
        progress(std::min(1.0, static_cast<double>(analysis_.frames().size()) / expected), "recording " + name_);
      }
    }
  }

  // Where the last frame was taken from. Photographs are too far apart to tell, and of a turn without a turntable the
  // picture says how the camera stands and not how the subject does.
  void locate() {
    if (camera_.info().photographs || name_ == "turn") return;
    const CoverageReading reading = coverage_.add(analysis_.reading(), analysis_.luma());
    constexpr double degrees = 180.0 / M_PI;
    azimuths_.push_back(reading.place.known ? std::optional(reading.place.azimuth * degrees) : std::nullopt);
  }

  Result<void> add(const Frame& frame) {
    const Result<std::string> jpeg = keyframe_jpeg(frame);
    if (!jpeg) return tl::unexpected(jpeg.error());
    if (const Result<void> opened = spool_.open_scan(scan_); !opened) return opened;
    return spool_.add_file(scan_.id, file_of(name_, frame.index), std::as_bytes(std::span(*jpeg)));
  }

  // Takes back what is in the spool and is no keyframe; returns the keyframes that are in it.
  Result<std::set<int>> settle(const std::set<int>& keyframes, RecordingSummary& summary) {
    std::set<int> there;
    const std::optional<SpooledScan> spooled = spool_.scan(scan_.id);
    if (!spooled) return there;
    for (const SpooledFile& file : spooled->files) {
      const std::optional<FrameId> id = parse_frame_name(std::filesystem::path(file.name).filename().string());
      if (!id || id->pass != name_) continue;
      if (file.phase == SpooledFilePhase::discarded) {
        if (!keyframes.contains(id->index)) ++summary.discarded;
        continue;
      }
      if (keyframes.contains(id->index)) {
        there.insert(id->index);
        ++summary.early_proposed;
        if (file.phase == SpooledFilePhase::acknowledged) ++summary.early_keyframes;
        continue;
      }
      ++summary.discarded;
      if (const Result<void> taken = spool_.discard(scan_.id, file.name); !taken) return tl::unexpected(taken.error());
    }
    return there;
  }

  Spool& spool_;
  const Scan& scan_;
  std::string name_;
  CameraDevice& camera_;
  PassAnalysis analysis_;
  Coverage coverage_;
  std::vector<std::optional<double>> azimuths_;  // by frame, degrees
};

}  // namespace

Result<RecordingSummary> record_scan(Spool& spool, Scan scan, std::span<const PassPlan> passes,
                                     const Progress& progress) {
  RecordingSummary summary;
  const std::optional<SpoolPhase> phase = spool.phase(scan.id);
  if (phase && *phase != SpoolPhase::recording) return summary;
  scan.passes.clear();
  for (const PassPlan& plan : passes) {
    const CameraInfo& camera = plan.camera->info();
    scan.passes.push_back(
        {plan.name, camera.fps, camera.expected_frames, camera.width, camera.height, camera.focal_35mm});
  }

  std::vector<FrameRecord> records;
  for (std::size_t i = 0; i < passes.size(); ++i) {
    PassRecorder recorder(spool, scan, passes[i]);
    const auto share = [&](double fraction, std::string_view what) {
      progress((static_cast<double>(i) + fraction) / static_cast<double>(passes.size()), what);
    };
    if (const Result<void> recorded = recorder.record(share); !recorded) return tl::unexpected(recorded.error());
    Result<std::vector<FrameRecord>> decided = recorder.finish(summary);
    if (!decided) return tl::unexpected(decided.error());
    records.insert(records.end(), std::make_move_iterator(decided->begin()), std::make_move_iterator(decided->end()));
    scan.passes[i] = recorder.pass();
  }
  if (const Result<void> closed = spool.close_scan(scan, records); !closed) return tl::unexpected(closed.error());
  return summary;
}

}  // namespace gyre
