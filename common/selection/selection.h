// SPDX-License-Identifier: Apache-2.0
// Which frames of a recording become keyframes: the exact two-pass rule, on two numbers per frame.
//
// Wenninger et al., "Realistic Virtual Humans from Smartphone Videos", VRST 2020, section 3.1:
//   f~ = f * Gaussian(sigma),  T = sum(f~) / N,  take a frame whenever the movement reaches T,
//   then replace it by the sharpest frame (variance of the Laplacian) of its k-neighbourhood.
// What the paper leaves open is settled here as follows.
//   - The first frame is taken, and the overshoot is carried: crossing i is the first frame at which the movement since
//     the start reaches i T, so uniform movement gives exactly N keyframes.
//   - k counts frames to each side; of equally sharp frames the one nearest to the crossing is taken.
//   - Keyframe i lies after keyframe i-1 and before crossing i+1, so keyframes are distinct and in order.
//   - It lies at most `largest_gap` T after keyframe i-1 and at most that much before crossing i+1. At the paper's
//     rates (T is about 32 frames of movement) this leaves the neighbourhood alone; where T is only a few frames it
//     keeps the replacement from opening holes. When no frame satisfies all of this, the last frame that is within
//     `largest_gap` T of keyframe i-1 is taken, and when there is none, the first one of the neighbourhood.
#pragma once

#include "common/result/result.h"

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace gyre {

// What is measured on a frame. The rule does not depend on the unit of either number, as long as it stays the same.
struct FrameMeasure {
  double motion = 0.0;     // mean length of the flow from the frame before, analysis pixels; 0 for the first frame
  double sharpness = 0.0;  // variance of the Laplacian
};

struct SelectionOptions {
  int keyframes = 75;          // N; fewer for a short recording, see attainable_keyframes
  int neighbourhood = 5;       // k, frames to each side
  double sigma = 2.0;          // of the smoothing, frames
  double largest_gap = 1.3;    // movement between two keyframes, in units of T
  double least_motion = 0.05;  // mean motion below which the camera did not move, analysis pixels a frame

  // N of the pass: body 75, head 50, turn 120.
  static SelectionOptions for_pass(std::string_view pass);
  Result<void> check() const;
};

struct FrameDecision {
  bool keyframe = false;
  std::string reason;  // a sentence
};

struct Selection {
  double threshold = 0.0;                        // T, analysis pixels
  std::vector<double> smoothed;                  // f~ of the movement that leads to each frame; 0 for the first
  std::vector<int> keyframes;                    // ascending
  std::vector<FrameDecision> decisions;          // one per frame
  std::vector<std::vector<int>> neighbourhoods;  // the frames each keyframe was chosen from, ascending
  double widest_gap = 0.0;                       // largest movement between two keyframes, in units of T
};

// Least number of frames a selection makes sense for.
inline constexpr int least_frames = 8;

// N of a recording with that many frames: as asked for, but at most a third of the frames. With fewer to a keyframe
// there is nothing to choose from, and a fast stretch could not keep to the largest gap.
int attainable_keyframes(const SelectionOptions& options, int frames);

// The rule. Errors: fewer than `least_frames` frames, no movement, options out of range.
Result<Selection> select_keyframes(std::span<const FrameMeasure> frames, const SelectionOptions& options);

// Every frame a keyframe, for photographs that a person has already chosen. Error: fewer than `least_frames`.
Result<Selection> keep_all(std::span<const FrameMeasure> frames);

// Smoothing of a sequence with a Gaussian cut at 4 sigma and renormalised where it leaves the sequence.
std::vector<double> smooth(std::span<const double> values, double sigma);

// The walk on its own: crossings and keyframes for a given T, over the movement accumulated up to each frame
// (ascending, one entry per frame, 0 for the first). Only crossings from number `first` on, as if keyframe first-1 were
// its own crossing; at most `limit` of them.
struct Walk {
  std::vector<int> crossings;
  std::vector<int> keyframes;                    // same size
  std::vector<std::vector<int>> neighbourhoods;  // same size
};
Walk walk(std::span<const double> travelled, std::span<const FrameMeasure> frames, double threshold, int first,
          int limit, const SelectionOptions& options);

}  // namespace gyre
