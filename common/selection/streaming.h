// SPDX-License-Identifier: Apache-2.0
// Guesses keyframes while the pass is still being recorded, so that most have left before the exact rule is applied.
#pragma once

#include "common/selection/selection.h"

#include <array>
#include <optional>
#include <vector>

namespace gyre {

struct StreamingOptions {
  SelectionOptions selection;
  int expected_frames = 0;  // length of the pass, as well as it is known; a guess is good enough
  double candidates = 1.6;  // at most so many frames are proposed for every keyframe

  Result<void> check() const;
};

// The exact rule needs T, hence the whole pass: one percent of error in T moves the 50th crossing by half a spacing.
// But the replacement by the sharpest frame pulls neighbouring crossings to the same frame. So the walk is run, around
// the frame in question, for a whole family of thresholds about the expected one, and the frames that most of these
// walks would take are proposed. Keeps three numbers a frame and no picture; belongs to one thread.
class StreamingSelector {
 public:
  // options.check() must hold. Takes the memory for `room` frames at once; more may follow.
  explicit StreamingSelector(const StreamingOptions& options, int room = 0);

  // Takes the measure of the next frame. Returns a frame, `latency` frames back, that should be sent now.
  std::optional<int> push(const FrameMeasure& frame);

  // The exact rule over everything that was pushed.
  Result<Selection> finish() const { return select_keyframes(frames_, options_.selection); }

  const std::vector<FrameMeasure>& frames() const { return frames_; }
  int proposed() const { return proposed_; }

  // Frames that have to be at hand behind the newest one.
  int latency() const;

 private:
  void extend_travelled();
  int walks_that_take(int frame) const;

  static constexpr int walks = 33;
  StreamingOptions options_;
  int expected_keyframes_;
  std::vector<FrameMeasure> frames_;
  std::vector<double> travelled_;  // smoothed movement up to each frame; the newest entries still change
  std::array<int, walks + 1> decided_by_walks_{};  // frames by the number of walks that took them
  int proposed_ = 0;
};

}  // namespace gyre
