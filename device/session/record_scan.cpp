// SPDX-License-Identifier: Apache-2.0
#include "device/session/record_scan.h"

#include <algorithm>
#include <chrono>
#include <iterator>

namespace gyre {

namespace {

constexpr std::chrono::milliseconds frame_timeout{1000};
constexpr int silent_timeouts = 10;  // in a row, then the camera counts as lost

Result<void> follow(CameraDevice& camera, PassRecorder& recorder, const Progress& progress, const std::string& pass) {
  int silent = 0;
  for (;;) {
    Result<CameraEvent> event = camera.next(frame_timeout);
    if (!event) return tl::unexpected(event.error());
    if (event->kind == CameraEvent::Kind::ended) return {};
    if (event->kind == CameraEvent::Kind::timeout) {
      if (event->recovering || ++silent < silent_timeouts) continue;
      return fail("the camera is silent", camera.info().name, "check its connection and run again");
    }
    silent = 0;
    const PassRecorder::Picked picked = recorder.add(std::move(*event->frame));
    if (picked.likely) {
      if (const Result<void> kept = recorder.keep(*picked.likely); !kept) return kept;
    }
    if (picked.spare) {
      if (const Result<void> remembered = recorder.remember(*picked.spare); !remembered) return remembered;
    }
    if (const int expected = camera.info().expected_frames; expected > 0) {
      progress(std::min(1.0, static_cast<double>(recorder.frames()) / expected), "recording " + pass);
    }
  }
}

}  // namespace

Result<RecordingSummary> record_scan(Spool& spool, Scan scan, std::span<const PassPlan> passes,
                                     const RecorderOptions& options, const Progress& progress) {
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
    CameraDevice& camera = *passes[i].camera;
    PassRecorder recorder(spool, scan, passes[i].name, camera.info(), options);
    const auto share = [&](double fraction, std::string_view what) {
      progress((static_cast<double>(i) + fraction) / static_cast<double>(passes.size()), what);
    };
    if (const Result<void> started = camera.start(); !started) return tl::unexpected(started.error());
    const Result<void> recorded = follow(camera, recorder, share, passes[i].name);
    camera.stop();
    if (!recorded) return tl::unexpected(recorded.error());
    const Result<Selection> selection = recorder.decide();
    if (!selection) return tl::unexpected(selection.error());
    Result<std::vector<FrameRecord>> decided = recorder.finish(
        *selection, [&](const auto& indices, const auto& take) { return camera.recall(indices, take); }, summary);
    if (!decided) return tl::unexpected(decided.error());
    records.insert(records.end(), std::make_move_iterator(decided->begin()), std::make_move_iterator(decided->end()));
    scan.passes[i] = recorder.pass();
  }
  if (const Result<void> closed = spool.close_scan(scan, records); !closed) return tl::unexpected(closed.error());
  return summary;
}

}  // namespace gyre
