// SPDX-License-Identifier: Apache-2.0
// Whether a frame is sharp, and whether the lens is searching, from how sharpness changes.
#pragma once

namespace gyre {

struct FocusOptions {
  double memory_s = 1.5;       // after which the sharpest frame counts for 1/e
  double sharp = 0.5;          // of the sharpest recent frame, from which on a frame is sharp
  double searching = 0.35;     // below which the lens is searching, ...
  double steady_motion = 0.9;  // ... when the picture moves less than this, widths a second
};

struct FocusReading {
  double sharpness = 1.0;  // against the sharpest recent frame, 0 to 1
  bool is_sharp = true;
  bool is_hunting = false;  // unsharp, and not because of motion
};

// Sharpness depends on what is seen, so frames are compared with those shortly before; what stays unsharp for several
// times the memory is taken for a picture without detail.
class FocusWatch {
 public:
  explicit FocusWatch(const FocusOptions& options = {}) : options_(options) {}

  // time: seconds, ascending; sharpness: variance of the Laplacian; motion: picture widths a second.
  FocusReading add(double time, double sharpness, double motion);

 private:
  FocusOptions options_;
  double best_ = 0.0;
  double time_ = 0.0;
};

}  // namespace gyre
