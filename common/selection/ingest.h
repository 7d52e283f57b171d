// SPDX-License-Identifier: Apache-2.0
// From a recorded capture to the keyframes of a pass in a bundle.
#pragma once

#include "common/bundle/bundle.h"
#include "common/log/log.h"
#include "common/selection/measure.h"
#include "common/selection/selection.h"
#include "common/video/frame_source.h"

#include <atomic>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace gyre {

struct MeasuredFrame {
  double time = 0.0;  // seconds since the start of the pass
  FrameMeasure measure;
  FrameSettings settings;
};

// Reads the source to its end and measures every frame.
Result<std::vector<MeasuredFrame>> measure_frames(FrameSource& source, const Progress& progress);

// True when a capture is taken as photographs that a person chose one by one: a folder of at most 150 pictures. Its
// frames all become keyframes; anything else is selected from.
bool is_photographs(const CaptureInfo& info);

// Measures all frames of the source and applies the rule, or keeps all frames when they are photographs. Errors: those
// of the source and of the rule.
struct MeasuredSelection {
  std::vector<MeasuredFrame> frames;
  Selection selection;
};
Result<MeasuredSelection> select_keyframes(FrameSource& source, const SelectionOptions& options,
                                           const Progress& progress);

// The lines of frames.jsonl of a pass.
std::vector<FrameRecord> frame_records(const std::string& pass, std::span<const MeasuredFrame> frames,
                                       const Selection& selection);

// The JPEG of a frame: the stored bytes when there are any, else its full picture, else its image compressed at
// `keyframe_quality`.
inline constexpr int keyframe_quality = 95;
Result<std::string> keyframe_jpeg(const Frame& frame);

// Selects the keyframes of a capture and writes them to the bundle as <pass>-<index>.jpg. Reads the capture twice, so
// that no more than one picture is in memory. When `cancel` becomes true the reading ends with an error. The caller
// adds `pass` to scan.json and `records` to frames.jsonl.
struct IngestedPass {
  ScanPass pass;
  std::vector<FrameRecord> records;
  int keyframes = 0;
};
Result<IngestedPass> ingest_capture(const std::filesystem::path& capture, const std::string& pass, const Bundle& bundle,
                                    const SelectionOptions& options, const Progress& progress,
                                    const std::atomic<bool>& cancel);

}  // namespace gyre
