// SPDX-License-Identifier: Apache-2.0
#include "device/guidance/guidance.h"

namespace gyre {

namespace {

constexpr std::size_t at(Condition condition) {
  return static_cast<std::size_t>(condition);
}

struct Entry {
  std::string_view name;
  Signal signal;
};

// By severity, as the enumeration.
constexpr std::array<Entry, condition_count> entries = {{
    {"camera_lost", {Colour::red, Pattern::fast_blink, Tone::double_low, "The camera is lost: stand still."}},
    {"disk_low", {Colour::red, Pattern::slow_blink, Tone::double_low, "The disk is full: stop and free some space."}},
    {"no_subject", {Colour::red, Pattern::steady, Tone::low, "Nobody is in the picture: point at the person."}},
    {"too_dark", {Colour::yellow, Pattern::slow_blink, Tone::low, "It is too dark: turn on more light."}},
    {"too_bright", {Colour::yellow, Pattern::slow_blink, Tone::high, "It is too bright: turn away from the light."}},
    {"subject_moved", {Colour::yellow, Pattern::pulse, Tone::double_low, "The person moved: ask them to hold still."}},
    {"too_fast", {Colour::yellow, Pattern::fast_blink, Tone::high, "Too fast: walk more slowly."}},
    {"blurred", {Colour::yellow, Pattern::steady, Tone::low, "The picture is blurred: hold the camera steady."}},
    {"too_close", {Colour::yellow, Pattern::steady, Tone::high, "Too close: step back."}},
    {"too_far", {Colour::yellow, Pattern::pulse, Tone::low, "Too far: step closer."}},
    {"direction_reversed", {Colour::yellow, Pattern::slow_blink, Tone::double_high, "Wrong way: turn around."}},
    {"done", {Colour::green, Pattern::steady, Tone::rising, "Done: press the button."}},
    {"gap_behind", {Colour::blue, Pattern::fast_blink, Tone::double_high, "There is a gap: walk on around once more."}},
    {"ring_closed", {Colour::green, Pattern::pulse, Tone::rising, "The ring is closed."}},
    {"head_pass", {Colour::blue, Pattern::pulse, Tone::rising, "The body is done: press the button for the head."}},
    {"next_ring", {Colour::blue, Pattern::pulse, Tone::high, "Next ring: lower the camera and walk on."}},
    {"crown", {Colour::blue, Pattern::slow_blink, Tone::high, "Lift the camera over the head."}},
    {"chin", {Colour::blue, Pattern::slow_blink, Tone::low, "Lower the camera and look up at the chin."}},
    {"host_gone", {Colour::white, Pattern::slow_blink, Tone::none, "No host: the scan is kept here, walk on."}},
}};

constexpr Signal all_well = {Colour::green, Pattern::slow_blink, Tone::none, "Recording: walk on around the person."};
constexpr Signal all_well_in_a_turn = {Colour::green, Pattern::slow_blink, Tone::none, "Recording: turn on slowly."};
constexpr Signal waiting = {Colour::white, Pattern::steady, Tone::none, "Ready: press the button to start."};

// What is said otherwise when nobody walks.
struct Wording {
  Condition condition;
  std::string_view sentence;
};
constexpr std::array turn_wordings = {
    Wording{Condition::too_fast, "Too fast: turn more slowly."},
    Wording{Condition::blurred, "The picture is blurred: look at the focus."},
    Wording{Condition::direction_reversed, "Wrong way: turn on as before."},
    Wording{Condition::gap_behind, "There is a gap: turn on once more."},
    Wording{Condition::ring_closed, "The turn is complete."},
    Wording{Condition::host_gone, "No host: the scan is kept here, turn on."},
};

// A value against two borders: the one that raises, or, once it has, the one that clears.
bool above(const std::optional<double>& value, bool was, double raise, double clear) {
  return value && *value > (was ? clear : raise);
}
bool below(const std::optional<double>& value, bool was, double raise, double clear) {
  return value && *value < (was ? clear : raise);
}

}  // namespace

std::string_view name_of(Condition condition) {
  return entries[at(condition)].name;
}

Signal signal_of(Condition condition, bool is_turn) {
  Signal signal = entries[at(condition)].signal;
  if (!is_turn) return signal;
  for (const Wording& wording : turn_wordings) {
    if (wording.condition == condition) signal.sentence = wording.sentence;
  }
  return signal;
}

Result<void> GuidanceOptions::check() const {
  if (!(raise_after_s >= 0.0 && clear_after_s >= 0.0)) return wrong_use("times of the guidance must not be negative");
  if (dark > no_longer_dark || bright < no_longer_bright || fast < no_longer_fast ||
      fast_around < no_longer_fast_around || moved < no_longer_moved || close > no_longer_close ||
      far < no_longer_far || reversed < no_longer_reversed) {
    return wrong_use("a value that clears a condition lies on the wrong side of the one that raises it");
  }
  return {};
}

Conditions Guidance::causes(const Observation& now) {
  Conditions is;
  const auto was = [&](Condition condition) { return caused_[at(condition)]; };
  const auto set = [&](Condition condition, bool value) { is[at(condition)] = value; };
  const GuidanceOptions& o = options_;
  set(Condition::camera_lost, !now.has_camera);
  set(Condition::disk_low, !now.has_disk);
  set(Condition::host_gone, !now.has_host);
  if (!now.has_camera) return is;  // nothing is known of the rest
  set(Condition::no_subject, now.has_subject == false);
  set(Condition::too_dark, below(now.brightness, was(Condition::too_dark), o.dark, o.no_longer_dark));
  set(Condition::too_bright, above(now.overexposed, was(Condition::too_bright), o.bright, o.no_longer_bright));
  if (!now.is_recording) return is;

  const bool was_fast = was(Condition::too_fast);
  const bool is_fast = above(now.motion, was_fast, o.fast, o.no_longer_fast) ||
                       above(now.azimuth_rate, was_fast, o.fast_around, o.no_longer_fast_around);
  set(Condition::too_fast, is_fast);
  // What is blurred because of haste is told by that.
  set(Condition::blurred, now.is_sharp == false && !is_fast);
  set(Condition::subject_moved, above(now.subject_motion, was(Condition::subject_moved), o.moved, o.no_longer_moved));
  set(Condition::too_close, below(now.distance, was(Condition::too_close), o.close, o.no_longer_close));
  set(Condition::too_far, above(now.distance, was(Condition::too_far), o.far, o.no_longer_far));
  set(Condition::direction_reversed,
      below(now.azimuth_rate, was(Condition::direction_reversed), -o.reversed, -o.no_longer_reversed));

  if (!now.is_closed) closed_at_.reset();
  if (now.is_closed && !closed_at_) closed_at_ = now.time;
  set(Condition::done, now.is_pass_complete && now.is_last_pass);
  set(Condition::head_pass, now.is_pass_complete && !now.is_last_pass);
  set(Condition::gap_behind, now.is_closed && now.has_gap);
  set(Condition::ring_closed, closed_at_ && now.time - *closed_at_ < o.ring_closed_s);
  const bool goes_on = now.is_closed && !now.has_gap && !now.is_pass_complete;
  set(Condition::next_ring, goes_on && now.next == Band::body_lower);
  set(Condition::crown, !now.is_pass_complete && now.next == Band::crown);
  set(Condition::chin, !now.is_pass_complete && now.next == Band::chin);
  return is;
}

const Conditions& Guidance::update(const Observation& now) {
  is_recording_ = now.is_recording;
  is_turn_ = now.is_turn;
  const Conditions is = causes(now);
  for (std::size_t i = 0; i < condition_count; ++i) {
    if (is[i] != caused_[i]) changed_at_[i] = now.time;
    const double lasted = now.time - changed_at_[i];
    if (is[i] && !raised_[i] && lasted >= options_.raise_after_s) raised_.set(i);
    if (!is[i] && raised_[i] && lasted >= options_.clear_after_s) raised_.reset(i);
  }
  caused_ = is;
  return raised_;
}

Signal Guidance::signal() const {
  for (std::size_t i = 0; i < condition_count; ++i) {
    if (raised_[i]) return signal_of(static_cast<Condition>(i), is_turn_);
  }
  if (!is_recording_) return waiting;
  return is_turn_ ? all_well_in_a_turn : all_well;
}

}  // namespace gyre
