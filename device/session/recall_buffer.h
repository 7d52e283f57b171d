// SPDX-License-Identifier: Apache-2.0
// The frames of a live camera that can be had once more: as many as fit into a bounded memory, spread over the whole
// recording.
#pragma once

#include "common/video/frame_source.h"

#include <cstddef>
#include <deque>
#include <string>

namespace gyre {

// Holds compressed pictures. When they become too many, twice as many neighbours share one place, and the one with the
// most bytes stays: at the one quality a camera compresses with, that is the one with the most detail. So what is left
// of a recording of any length has no long holes and few blurred pictures.
class RecallBuffer {
 public:
  explicit RecallBuffer(std::size_t limit_bytes) : limit_(limit_bytes) {}

  struct Kept {
    int index = 0;
    double time = 0.0;
    std::string jpeg;
    FrameSettings settings;
  };

  void clear();
  // Frames in ascending order; those without a compressed picture are passed over.
  void add(const Frame& frame);
  // Nothing when it is not there (any more).
  const Kept* find(int index) const;

  std::size_t bytes() const { return bytes_; }
  int frames_per_place() const { return stride_; }
  const std::deque<Kept>& kept() const { return kept_; }

 private:
  void thin();

  std::size_t limit_;
  std::size_t bytes_ = 0;
  int stride_ = 1;
  std::deque<Kept> kept_;  // ascending, at most one of every `stride_` frames
};

}  // namespace gyre
