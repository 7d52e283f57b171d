// SPDX-License-Identifier: Apache-2.0
#include "device/session/session_state.h"

#include <array>

namespace gyre {

namespace {

using State = SessionState;
using Event = SessionEvent;
using Guard = SessionGuard;
using Action = SessionAction;

// The first row that fits counts.
constexpr SessionTransition transitions[] = {
    {State::idle, Event::start, Guard::always, {State::arming, Action::arm}},
    {State::idle, Event::camera_lost, Guard::always, {State::fault, Action::none}},
    {State::idle, Event::disk_low, Guard::always, {State::fault, Action::none}},
    {State::idle, Event::restart, Guard::always, {State::idle, Action::none}},

    {State::arming, Event::camera_settled, Guard::always, {State::pass, Action::record}},
    {State::arming, Event::settle_timeout, Guard::always, {State::pass, Action::record}},
    {State::arming, Event::stop, Guard::has_pass, {State::between_passes, Action::disarm}},
    {State::arming, Event::stop, Guard::no_pass, {State::idle, Action::disarm}},
    {State::arming, Event::cancel, Guard::has_pass, {State::between_passes, Action::disarm}},
    {State::arming, Event::cancel, Guard::no_pass, {State::idle, Action::disarm}},
    {State::arming, Event::shut_down, Guard::has_pass, {State::between_passes, Action::disarm}},
    {State::arming, Event::shut_down, Guard::no_pass, {State::idle, Action::disarm}},
    {State::arming, Event::camera_given_up, Guard::has_pass, {State::between_passes, Action::disarm}},
    {State::arming, Event::camera_given_up, Guard::no_pass, {State::idle, Action::disarm}},
    {State::arming, Event::disk_low, Guard::always, {State::fault, Action::disarm}},
    {State::arming, Event::restart, Guard::has_cut_pass, {State::finishing, Action::recover_pass}},
    {State::arming, Event::restart, Guard::has_pass, {State::between_passes, Action::none}},
    {State::arming, Event::restart, Guard::no_pass, {State::idle, Action::forget}},

    // A lost camera does not end the pass: it goes on when the camera is back.
    {State::pass, Event::stop, Guard::always, {State::finishing, Action::close_pass}},
    {State::pass, Event::recording_ended, Guard::always, {State::finishing, Action::close_pass}},
    {State::pass, Event::shut_down, Guard::always, {State::finishing, Action::close_pass}},
    {State::pass, Event::camera_given_up, Guard::always, {State::finishing, Action::close_pass}},
    {State::pass, Event::disk_low, Guard::always, {State::finishing, Action::close_pass}},
    {State::pass, Event::storage_failed, Guard::always, {State::finishing, Action::close_pass}},
    {State::pass, Event::cancel, Guard::has_pass, {State::between_passes, Action::drop_pass}},
    {State::pass, Event::cancel, Guard::no_pass, {State::idle, Action::drop_pass}},
    {State::pass, Event::restart, Guard::has_cut_pass, {State::finishing, Action::recover_pass}},
    {State::pass, Event::restart, Guard::has_pass, {State::between_passes, Action::none}},
    {State::pass, Event::restart, Guard::no_pass, {State::idle, Action::forget}},

    {State::finishing, Event::pass_closed, Guard::has_next, {State::between_passes, Action::none}},
    {State::finishing, Event::pass_closed, Guard::no_next, {State::finishing, Action::close_scan}},
    {State::finishing, Event::pass_unusable, Guard::has_pass, {State::between_passes, Action::drop_pass}},
    {State::finishing, Event::pass_unusable, Guard::no_pass, {State::idle, Action::drop_pass}},
    {State::finishing, Event::scan_closed, Guard::has_host, {State::waiting_for_host, Action::none}},
    {State::finishing, Event::scan_closed, Guard::no_host, {State::idle, Action::forget}},
    {State::finishing, Event::storage_failed, Guard::always, {State::fault, Action::none}},
    {State::finishing, Event::restart, Guard::has_cut_pass, {State::finishing, Action::recover_pass}},
    {State::finishing, Event::restart, Guard::has_pass, {State::finishing, Action::close_scan}},
    {State::finishing, Event::restart, Guard::no_pass, {State::idle, Action::forget}},

    {State::between_passes, Event::start, Guard::always, {State::arming, Action::arm}},
    {State::between_passes, Event::cancel, Guard::always, {State::finishing, Action::close_scan}},
    {State::between_passes, Event::camera_lost, Guard::always, {State::fault, Action::none}},
    {State::between_passes, Event::disk_low, Guard::always, {State::fault, Action::none}},
    {State::between_passes, Event::restart, Guard::always, {State::between_passes, Action::none}},

    {State::waiting_for_host, Event::all_acknowledged, Guard::always, {State::waiting_for_host, Action::none}},
    {State::waiting_for_host, Event::avatar_received, Guard::always, {State::avatar_ready, Action::none}},
    {State::waiting_for_host, Event::reconstruction_failed, Guard::always, {State::fault, Action::forget}},
    {State::waiting_for_host, Event::start, Guard::always, {State::arming, Action::arm}},
    {State::waiting_for_host, Event::cancel, Guard::always, {State::idle, Action::forget}},
    {State::waiting_for_host, Event::restart, Guard::always, {State::waiting_for_host, Action::none}},

    {State::avatar_ready, Event::acknowledge, Guard::always, {State::idle, Action::forget}},
    {State::avatar_ready, Event::cancel, Guard::always, {State::idle, Action::forget}},
    {State::avatar_ready, Event::start, Guard::always, {State::arming, Action::arm}},
    {State::avatar_ready, Event::restart, Guard::always, {State::avatar_ready, Action::none}},

    {State::fault, Event::trouble_over, Guard::has_cut_pass, {State::finishing, Action::recover_pass}},
    {State::fault, Event::trouble_over, Guard::has_pass, {State::between_passes, Action::none}},
    {State::fault, Event::trouble_over, Guard::no_pass, {State::idle, Action::none}},
    {State::fault, Event::acknowledge, Guard::has_cut_pass, {State::finishing, Action::recover_pass}},
    {State::fault, Event::acknowledge, Guard::has_pass, {State::between_passes, Action::none}},
    {State::fault, Event::acknowledge, Guard::no_pass, {State::idle, Action::none}},
    {State::fault, Event::cancel, Guard::has_cut_pass, {State::finishing, Action::recover_pass}},
    {State::fault, Event::cancel, Guard::has_pass, {State::finishing, Action::close_scan}},
    {State::fault, Event::cancel, Guard::no_pass, {State::idle, Action::none}},
    {State::fault, Event::restart, Guard::has_cut_pass, {State::finishing, Action::recover_pass}},
    {State::fault, Event::restart, Guard::has_pass, {State::between_passes, Action::none}},
    {State::fault, Event::restart, Guard::no_pass, {State::idle, Action::forget}},
};

constexpr std::array<std::string_view, session_state_count> state_names = {
    "idle", "arming", "pass", "between_passes", "finishing", "waiting_for_host", "avatar_ready", "fault"};
constexpr std::array<std::string_view, session_event_count> event_names = {"start",
                                                                           "stop",
                                                                           "cancel",
                                                                           "acknowledge",
                                                                           "shut_down",
                                                                           "camera_settled",
                                                                           "settle_timeout",
                                                                           "camera_lost",
                                                                           "camera_given_up",
                                                                           "recording_ended",
                                                                           "disk_low",
                                                                           "storage_failed",
                                                                           "trouble_over",
                                                                           "pass_closed",
                                                                           "pass_unusable",
                                                                           "scan_closed",
                                                                           "all_acknowledged",
                                                                           "avatar_received",
                                                                           "reconstruction_failed",
                                                                           "restart"};

}  // namespace

std::span<const SessionTransition> session_transitions() {
  return transitions;
}

bool holds(SessionGuard guard, const SessionFacts& facts) {
  switch (guard) {
    case Guard::always:
      return true;
    case Guard::has_cut_pass:
      return facts.has_cut_pass;
    case Guard::has_pass:
      return facts.has_pass && !facts.has_cut_pass;
    case Guard::no_pass:
      return !facts.has_pass && !facts.has_cut_pass;
    case Guard::has_next:
      return facts.has_next;
    case Guard::no_next:
      return !facts.has_next;
    case Guard::has_host:
      return facts.has_host;
    case Guard::no_host:
      return !facts.has_host;
  }
  return false;
}

SessionStep next_step(SessionState state, SessionEvent event, const SessionFacts& facts) {
  for (const SessionTransition& t : transitions) {
    if (t.from == state && t.event == event && holds(t.guard, facts)) return t.step;
  }
  return {state, SessionAction::none};
}

std::string_view name_of(SessionState state) {
  return state_names[static_cast<std::size_t>(state)];
}

std::string_view name_of(SessionEvent event) {
  return event_names[static_cast<std::size_t>(event)];
}

}  // namespace gyre
