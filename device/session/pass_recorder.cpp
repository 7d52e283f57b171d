// SPDX-License-Identifier: Apache-2.0
#include "device/session/pass_recorder.h"

#include "common/selection/frame_room.h"
#include "common/selection/ingest.h"
#include "device/session/kept_selection.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace gyre {

namespace {

std::string file_of(const std::string& pass, int index) {
  return "frames/" + frame_name(pass, index);
}

// A recording has its own end, and its numbers grow with it.
int room_of(const CameraInfo& camera, int most_frames) {
  return camera.live ? most_frames : 0;
}

}  // namespace

PassRecorder::PassRecorder(Spool& spool, Scan scan, std::string pass, CameraInfo camera, const RecorderOptions& options)
    : spool_(spool),
      scan_(std::move(scan)),
      name_(std::move(pass)),
      camera_(std::move(camera)),
      most_frames_(options.most_frames),
      analysis_(name_, camera_, scan_.camera, options.measure, room_of(camera_, most_frames_)),
      coverage_(name_, lens_of(camera_, scan_.camera)),
      places_(room_for<FramePlace>(room_of(camera_, most_frames_))),
      remembered_(options.memory) {}

PassRecorder::Picked PassRecorder::add(Frame frame, std::optional<double> turntable) {
  std::optional<Frame> copy;
  if (camera_.live) copy = frame;
  Picked picked;
  picked.likely = analysis_.add(std::move(frame));
  if (copy) picked.spare = spare_of(std::move(*copy));
  if (camera_.photographs) return picked;
  place_ = coverage_.add(analysis_.reading(), analysis_.luma(), turntable);
  FramePlace& place = places_.emplace_back();
  if (place_->place.known) place.azimuth = static_cast<float>(place_->place.azimuth);
  place.quality = static_cast<float>(analysis_.reading().focus.sharpness);
  place.band = place_->band;
  return picked;
}

// A compressed frame costs only its memory. Of others the sharpest of a few is worth compressing; every neighbourhood
// of the rule has two such groups in it.
std::optional<Frame> PassRecorder::spare_of(Frame frame) {
  if (!frame.jpeg.empty()) return frame;
  constexpr int group = 4;
  const double sharpness = analysis_.reading().measure.sharpness;
  const bool is_last = frame.index % group == group - 1;
  if (!sharpest_ || sharpness > sharpness_) {
    sharpest_ = std::move(frame);
    sharpness_ = sharpness;
  }
  return is_last ? std::exchange(sharpest_, std::nullopt) : std::nullopt;
}

ScanPass PassRecorder::pass() const {
  return {name_, camera_.fps, frames(), camera_.width, camera_.height, camera_.focal_35mm};
}

Result<void> PassRecorder::store(int index, const std::string& jpeg) {
  if (const Result<void> opened = spool_.open_scan(scan_); !opened) return opened;
  return spool_.add_file(scan_.id, file_of(name_, index), std::as_bytes(std::span(jpeg)));
}

Result<void> PassRecorder::keep(const Frame& likely) {
  const Result<std::string> jpeg = keyframe_jpeg(likely);
  if (!jpeg) return tl::unexpected(jpeg.error());
  return store(likely.index, *jpeg);
}

Result<void> PassRecorder::remember(const Frame& spare) {
  if (!spare.jpeg.empty()) {
    remembered_.add(spare);
    return {};
  }
  Result<std::string> jpeg = keyframe_jpeg(spare);
  if (!jpeg) return tl::unexpected(jpeg.error());
  remembered_.add({.index = spare.index, .time = spare.time, .image = {}, .jpeg = std::move(*jpeg)});
  return {};
}

// The frames of this pass that are in the spool.
std::set<int> PassRecorder::spooled() const {
  std::set<int> there;
  const std::optional<SpooledScan> scan = spool_.scan(scan_.id);
  if (!scan) return there;
  for (const SpooledFile& file : scan->files) {
    const std::optional<FrameId> id = parse_frame_name(std::filesystem::path(file.name).filename().string());
    if (id && id->pass == name_ && file.phase != SpooledFilePhase::discarded) there.insert(id->index);
  }
  return there;
}

Result<Selection> PassRecorder::decide() const {
  const std::set<int> there = camera_.live ? spooled() : std::set<int>();
  const auto is_kept = [&](int i) { return !camera_.live || there.contains(i) || remembered_.find(i) != nullptr; };
  const auto rule = [&]() -> Result<Selection> {
    if (!camera_.live) return analysis_.finish();
    return select_among_kept(analysis_.measures(), is_kept, SelectionOptions::for_pass(name_));
  };
  Result<Selection> selection = rule();
  if (!selection && selection.error().kind == Error::Kind::failed) {
    selection.error().where = "pass " + name_ + " (" + camera_.name + "), " + selection.error().where;
  }
  if (selection) keep_least_bad(*selection, unsharp_sectors(map(), name_), places_, is_kept);
  return selection;
}

Result<std::vector<FrameRecord>> PassRecorder::finish(const Selection& selection, const Recall& recall,
                                                      RecordingSummary& summary) {
  const std::set<int> keyframes(selection.keyframes.begin(), selection.keyframes.end());
  const Result<std::set<int>> there = settle(keyframes, summary);
  if (!there) return tl::unexpected(there.error());

  std::vector<int> missing;
  std::set_difference(keyframes.begin(), keyframes.end(), there->begin(), there->end(), std::back_inserter(missing));
  if (camera_.live) {
    for (const int index : missing) {
      const RecallBuffer::Kept* const kept = remembered_.find(index);
      if (kept == nullptr) return fail("a frame was not kept", std::to_string(index));
      if (const Result<void> stored = store(index, kept->jpeg); !stored) return tl::unexpected(stored.error());
    }
  } else {
    const Result<void> recalled = recall(missing, [&](const Frame& frame) { return keep(frame); });
    if (!recalled) return tl::unexpected(recalled.error());
  }

  summary.frames += frames();
  summary.keyframes += static_cast<int>(keyframes.size());
  summary.unsharp_sectors += static_cast<int>(unsharp_sectors(map(), name_).size());
  std::vector<FrameRecord> records = frame_records(name_, analysis_.frames(), selection);
  constexpr double degrees = 180.0 / M_PI;
  for (std::size_t i = 0; i < places_.size(); ++i) {
    if (places_[i].azimuth) records[i].azimuth = *places_[i].azimuth * degrees;
  }
  return records;
}

// Takes back what is in the spool and is no keyframe; returns the keyframes that are in it.
Result<std::set<int>> PassRecorder::settle(const std::set<int>& keyframes, RecordingSummary& summary) {
  std::set<int> there;
  const std::optional<SpooledScan> scan = spool_.scan(scan_.id);
  if (!scan) return there;
  for (const SpooledFile& file : scan->files) {
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

}  // namespace gyre
