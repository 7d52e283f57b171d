// SPDX-License-Identifier: Apache-2.0
// What the operator is told at every moment: a set of conditions, and the one signal of the most severe of them.
//
// A pure state machine: it knows what it is given and nothing else, time included.
#pragma once

#include "common/result/result.h"
#include "device/coverage/coverage_map.h"

#include <array>
#include <bitset>
#include <optional>
#include <string_view>

namespace gyre {

// The most severe first.
enum class Condition {
  camera_lost,
  disk_low,
  no_subject,
  too_dark,
  too_bright,
  subject_moved,
  too_fast,
  blurred,
  too_close,
  too_far,
  direction_reversed,
  done,
  gap_behind,
  ring_closed,
  head_pass,
  next_ring,
  crown,
  chin,
  host_gone,  // the scan is kept here meanwhile
};
inline constexpr std::size_t condition_count = static_cast<std::size_t>(Condition::host_gone) + 1;
using Conditions = std::bitset<condition_count>;

enum class Colour { off, white, green, blue, yellow, red };
enum class Pattern { steady, slow_blink, fast_blink, pulse };
enum class Tone { none, low, high, double_low, double_high, rising };

// One signal at a time.
struct Signal {
  Colour colour = Colour::off;
  Pattern pattern = Pattern::steady;
  Tone tone = Tone::none;  // when the signal begins
  std::string_view sentence;
  bool operator==(const Signal&) const = default;
};

// A short name for logs and pages: "too_fast".
std::string_view name_of(Condition condition);
// is_turn: the person turns before a camera that stands, and nobody walks.
Signal signal_of(Condition condition, bool is_turn = false);

// What is known at one moment. Nothing in an optional: not measured, which raises and clears as if all were well.
struct Observation {
  double time = 0.0;  // seconds, ascending
  bool is_recording = false;
  bool is_turn = false;  // the person turns before a camera that stands
  bool has_camera = true;
  bool has_disk = true;  // room for the rest of the scan
  bool has_host = true;  // or none is wanted
  std::optional<bool> has_subject;
  std::optional<double> brightness;   // mean luma, 0 to 1
  std::optional<double> overexposed;  // share of pixels at white
  std::optional<double> motion;       // mean flow, picture widths a second
  std::optional<bool> is_sharp;
  std::optional<double> subject_motion;  // see CameraMotion, pixels
  std::optional<double> distance;        // to the subject, against the usual one
  std::optional<double> azimuth_rate;    // radians a second, positive in the direction of the pass
  // Coverage; only the parts of the pass that is on.
  bool is_closed = false;         // the ring the camera is on has been walked all around ...
  bool has_gap = false;           // ... and there are sectors on it without a sharp frame
  std::optional<Band> next;       // band that is to be seen after the one the camera is in
  bool is_pass_complete = false;  // all bands of the pass
  bool is_last_pass = false;
};

struct GuidanceOptions {
  double raise_after_s = 0.25;  // a cause has to last before its condition is raised, ...
  double clear_after_s = 0.5;   // ... and to be gone before it is cleared
  double ring_closed_s = 2.0;   // for which the closed ring is announced
  // Each with the value that clears it.
  double dark = 0.12, no_longer_dark = 0.16;      // mean luma
  double bright = 0.25, no_longer_bright = 0.18;  // share of white pixels
  double fast = 1.1, no_longer_fast = 0.85;       // widths a second
  // Radians a second around the subject: who stands in the middle of the picture hardly moves in it.
  double fast_around = 1.4, no_longer_fast_around = 1.1;
  double moved = 2.3, no_longer_moved = 1.6;   // pixels
  double close = 0.7, no_longer_close = 0.78;  // of the usual distance
  double far = 1.45, no_longer_far = 1.32;
  double reversed = 0.12, no_longer_reversed = 0.03;  // radians a second backwards

  Result<void> check() const;
};

class Guidance {
 public:
  // options.check() must hold.
  explicit Guidance(const GuidanceOptions& options = {}) : options_(options) {}

  // Takes in what is known now; returns what is raised.
  const Conditions& update(const Observation& now);

  const Conditions& conditions() const { return raised_; }
  bool is_raised(Condition condition) const { return raised_[static_cast<std::size_t>(condition)]; }

  // Of the most severe condition; without any: that all is well while recording, or that the rig waits.
  Signal signal() const;

 private:
  Conditions causes(const Observation& now);

  GuidanceOptions options_;
  Conditions raised_;
  Conditions caused_;                                 // at the last update, with the values that clear them
  std::array<double, condition_count> changed_at_{};  // when the cause came or went
  std::optional<double> closed_at_;
  bool is_recording_ = false;
  bool is_turn_ = false;
};

}  // namespace gyre
