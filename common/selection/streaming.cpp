// SPDX-License-Identifier: Apache-2.0
#include "common/selection/streaming.h"

#include "common/selection/frame_room.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace gyre {

namespace {

// The smoothing that is still missing when a frame is decided changes its movement little; waiting for all of it would
// cost pictures held in memory.
constexpr int smoothing_lag = 3;

}  // namespace

Result<void> StreamingOptions::check() const {
  if (expected_frames < 1) return wrong_use("the expected length must be positive", std::to_string(expected_frames));
  if (!(candidates >= 1.0)) return wrong_use("candidates per keyframe must be 1 or more", std::to_string(candidates));
  return selection.check();
}

StreamingSelector::StreamingSelector(const StreamingOptions& options, int room)
    : options_(options),
      expected_keyframes_(std::max(1, attainable_keyframes(options.selection, options.expected_frames))),
      frames_(room_for<FrameMeasure>(room)),
      travelled_(room_for<double>(room)) {}

int StreamingSelector::latency() const {
  return options_.selection.neighbourhood + smoothing_lag;
}

void StreamingSelector::extend_travelled() {
  const int count = static_cast<int>(frames_.size());
  const int radius = static_cast<int>(std::ceil(4.0 * options_.selection.sigma));
  travelled_.push_back(0.0);
  // A new movement changes the smoothed value of `radius` frames before it; those need `radius` more on their left.
  const int first_changed = std::max(1, count - 1 - radius);
  const int first_needed = std::max(1, first_changed - radius);
  std::vector<double> motion;
  for (int i = first_needed; i < count; ++i) motion.push_back(frames_[static_cast<std::size_t>(i)].motion);
  const std::vector<double> smoothed = smooth(motion, options_.selection.sigma);
  for (int i = first_changed; i < count; ++i) {
    travelled_[static_cast<std::size_t>(i)] =
        travelled_[static_cast<std::size_t>(i - 1)] + smoothed[static_cast<std::size_t>(i - first_needed)];
  }
}

int StreamingSelector::walks_that_take(int frame) const {
  constexpr double spread = 1.5;  // thresholds from T / spread to T * spread, evenly in their logarithm
  constexpr int warm_up = 4;      // crossings before the frame; a walk soon forgets where it began
  constexpr int look_ahead = 4;
  const double done = std::min(1.0, static_cast<double>(frames_.size()) / options_.expected_frames);
  const double expected = travelled_.back() / (done * expected_keyframes_);
  if (!(travelled_.back() > options_.selection.least_motion * static_cast<double>(frames_.size()))) return 0;

  int taken = 0;
  for (int i = 0; i < walks; ++i) {
    const double threshold = expected * std::pow(spread, 2.0 * i / (walks - 1) - 1.0);
    const int passed = static_cast<int>(travelled_[static_cast<std::size_t>(frame)] / threshold);
    const int first = std::max(0, passed - warm_up);
    const Walk around = walk(travelled_, frames_, threshold, first, passed - first + look_ahead, options_.selection);
    if (std::binary_search(around.keyframes.begin(), around.keyframes.end(), frame)) ++taken;
  }
  return taken;
}

std::optional<int> StreamingSelector::push(const FrameMeasure& frame) {
  frames_.push_back(frame);
  extend_travelled();
  const int decided = static_cast<int>(frames_.size()) - 1 - latency();
  if (decided < 0) return std::nullopt;

  const int taken = walks_that_take(decided);
  ++decided_by_walks_[static_cast<std::size_t>(taken)];
  // Propose the best part of all frames so far, as large a part as the candidates are of the whole pass.
  const double most = options_.candidates * expected_keyframes_;
  const double part = std::min(1.0, most / options_.expected_frames);
  const int better = std::accumulate(decided_by_walks_.begin() + taken + 1, decided_by_walks_.end(), 0);
  const bool is_among_best = better < part * (decided + 1);
  if (taken == 0 || !is_among_best || proposed_ + 1 > most) return std::nullopt;
  ++proposed_;
  return decided;
}

}  // namespace gyre
