// SPDX-License-Identifier: Apache-2.0
#include "device/session/signals.h"

#include <optional>

namespace gyre {

namespace {

// The most severe of the conditions that keep a good pass from being begun.
std::optional<Condition> obstacle(const Guidance& guidance) {
  for (const Condition condition : {Condition::camera_lost, Condition::disk_low, Condition::no_subject,
                                    Condition::too_dark, Condition::too_bright}) {
    if (guidance.is_raised(condition)) return condition;
  }
  return std::nullopt;
}

}  // namespace

Signal signal_of(SessionState state, const Guidance& guidance) {
  const std::optional<Condition> in_the_way = obstacle(guidance);
  switch (state) {
    case SessionState::idle:
      if (in_the_way) return signal_of(*in_the_way);
      return {Colour::white, Pattern::steady, Tone::none, "Ready: press the button to start."};
    case SessionState::arming:
      if (in_the_way == Condition::camera_lost) return signal_of(*in_the_way);
      return {Colour::white, Pattern::fast_blink, Tone::high, "Stand still: the camera settles."};
    case SessionState::pass:
      return guidance.signal();
    case SessionState::between_passes:
      if (in_the_way) return signal_of(*in_the_way);
      return {Colour::blue, Pattern::pulse, Tone::rising,
              "That pass is done: press for the next one, or hold the button to end the scan."};
    case SessionState::finishing:
      return {Colour::green, Pattern::fast_blink, Tone::rising, "Recorded: one moment."};
    case SessionState::waiting_for_host:
      if (guidance.is_raised(Condition::host_gone)) {
        return {Colour::white, Pattern::slow_blink, Tone::none, "No host: the scan is kept here until it answers."};
      }
      return {Colour::white, Pattern::pulse, Tone::none, "The person may go: the host makes the avatar."};
    case SessionState::avatar_ready:
      return {Colour::green, Pattern::steady, Tone::double_high, "The avatar is here: press the button."};
    case SessionState::fault:
      if (in_the_way) return signal_of(*in_the_way);
      return {Colour::red, Pattern::steady, Tone::double_low, "Something is wrong: the page says what."};
  }
  return {};
}

}  // namespace gyre
