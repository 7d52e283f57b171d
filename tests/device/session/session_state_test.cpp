// SPDX-License-Identifier: Apache-2.0
#include "device/session/session_state.h"

#include "device/session/operator_command.h"

#include <gtest/gtest.h>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <vector>

namespace gyre {
namespace {

using State = SessionState;
using Event = SessionEvent;
using Action = SessionAction;

std::vector<State> all_states() {
  std::vector<State> states;
  for (int i = 0; i < session_state_count; ++i) states.push_back(static_cast<State>(i));
  return states;
}
std::vector<Event> all_events() {
  std::vector<Event> events;
  for (int i = 0; i < session_event_count; ++i) events.push_back(static_cast<Event>(i));
  return events;
}
std::vector<SessionFacts> all_facts() {
  std::vector<SessionFacts> all;
  for (int bits = 0; bits < 16; ++bits)
    all.push_back({(bits & 1) != 0, (bits & 2) != 0, (bits & 4) != 0, (bits & 8) != 0});
  return all;
}

// What README.md says, for a scan without, with and with a cut pass: state, event, and where each of the three leads.
struct Row {
  State from;
  Event event;
  State empty, recorded, cut;
};
constexpr Row rows[] = {
    {State::idle, Event::start, State::arming, State::arming, State::arming},
    {State::idle, Event::camera_lost, State::fault, State::fault, State::fault},
    {State::idle, Event::disk_low, State::fault, State::fault, State::fault},
    {State::arming, Event::stop, State::idle, State::between_passes, State::arming},
    {State::arming, Event::cancel, State::idle, State::between_passes, State::arming},
    {State::arming, Event::shut_down, State::idle, State::between_passes, State::arming},
    {State::arming, Event::camera_settled, State::pass, State::pass, State::pass},
    {State::arming, Event::settle_timeout, State::pass, State::pass, State::pass},
    {State::arming, Event::camera_given_up, State::idle, State::between_passes, State::arming},
    {State::arming, Event::disk_low, State::fault, State::fault, State::fault},
    {State::arming, Event::restart, State::idle, State::between_passes, State::finishing},
    {State::pass, Event::stop, State::finishing, State::finishing, State::finishing},
    {State::pass, Event::cancel, State::idle, State::between_passes, State::pass},
    {State::pass, Event::shut_down, State::finishing, State::finishing, State::finishing},
    {State::pass, Event::camera_given_up, State::finishing, State::finishing, State::finishing},
    {State::pass, Event::recording_ended, State::finishing, State::finishing, State::finishing},
    {State::pass, Event::disk_low, State::finishing, State::finishing, State::finishing},
    {State::pass, Event::storage_failed, State::finishing, State::finishing, State::finishing},
    {State::pass, Event::restart, State::idle, State::between_passes, State::finishing},
    {State::between_passes, Event::start, State::arming, State::arming, State::arming},
    {State::between_passes, Event::cancel, State::finishing, State::finishing, State::finishing},
    {State::between_passes, Event::camera_lost, State::fault, State::fault, State::fault},
    {State::between_passes, Event::disk_low, State::fault, State::fault, State::fault},
    {State::finishing, Event::pass_unusable, State::idle, State::between_passes, State::finishing},
    {State::finishing, Event::storage_failed, State::fault, State::fault, State::fault},
    {State::finishing, Event::restart, State::idle, State::finishing, State::finishing},
    {State::waiting_for_host, Event::start, State::arming, State::arming, State::arming},
    {State::waiting_for_host, Event::cancel, State::idle, State::idle, State::idle},
    {State::waiting_for_host, Event::avatar_received, State::avatar_ready, State::avatar_ready, State::avatar_ready},
    {State::waiting_for_host, Event::reconstruction_failed, State::fault, State::fault, State::fault},
    {State::avatar_ready, Event::start, State::arming, State::arming, State::arming},
    {State::avatar_ready, Event::cancel, State::idle, State::idle, State::idle},
    {State::avatar_ready, Event::acknowledge, State::idle, State::idle, State::idle},
    {State::fault, Event::cancel, State::idle, State::finishing, State::finishing},
    {State::fault, Event::acknowledge, State::idle, State::between_passes, State::finishing},
    {State::fault, Event::trouble_over, State::idle, State::between_passes, State::finishing},
    {State::fault, Event::restart, State::idle, State::between_passes, State::finishing},
};

// Every pair of state and event, with everything it may depend on: it leads where the rows say, and nowhere else.
TEST(SessionState, TakesExactlyTheDocumentedSteps) {
  for (const State state : all_states()) {
    for (const Event event : all_events()) {
      for (const SessionFacts& facts : all_facts()) {
        SCOPED_TRACE(std::string(name_of(state)) + " + " + std::string(name_of(event)));
        State expected = state;
        for (const Row& row : rows) {
          if (row.from != state || row.event != event) continue;
          expected = facts.has_cut_pass ? row.cut : facts.has_pass ? row.recorded : row.empty;
        }
        if (state == State::finishing && event == Event::pass_closed && facts.has_next) {
          expected = State::between_passes;
        }
        if (state == State::finishing && event == Event::scan_closed) {
          expected = facts.has_host ? State::waiting_for_host : State::idle;
        }
        EXPECT_EQ(next_step(state, event, facts).to, expected);
      }
    }
  }
}

TEST(SessionState, EveryRowCanBeReached) {
  for (const SessionTransition& row : session_transitions()) {
    bool is_reached = false;
    for (const SessionFacts& facts : all_facts()) {
      const SessionStep step = next_step(row.from, row.event, facts);
      is_reached |= holds(row.guard, facts) && step.to == row.step.to && step.action == row.step.action;
    }
    EXPECT_TRUE(is_reached) << name_of(row.from) << " + " << name_of(row.event);
  }
}

TEST(SessionState, EveryStateIsReachedAndLeft) {
  std::set<State> reached = {State::idle};
  for (int round = 0; round < session_state_count; ++round) {
    for (const State state : std::set<State>(reached)) {
      for (const SessionTransition& row : session_transitions()) {
        if (row.from == state && row.event != Event::restart) reached.insert(row.step.to);
      }
    }
  }
  EXPECT_EQ(reached.size(), all_states().size());
  for (const State state : all_states()) {
    bool is_left = false;
    for (const SessionTransition& row : session_transitions())
      is_left |= row.from == state && row.step.to != state && row.event != Event::restart;
    EXPECT_TRUE(is_left) << name_of(state);
  }
}

// Whatever it ended in, the program knows after a start what to do, and nothing that is recorded is dropped.
TEST(SessionState, ARestartLosesNothing) {
  for (const State state : all_states()) {
    for (const SessionFacts& facts : all_facts()) {
      const SessionStep step = next_step(state, Event::restart, facts);
      EXPECT_NE(step.action, Action::drop_pass);
      EXPECT_NE(step.to, State::pass);
      const bool is_recording =
          state == State::arming || state == State::pass || state == State::finishing || state == State::fault;
      EXPECT_TRUE(is_recording || step.to == state);
      EXPECT_TRUE(!is_recording || !facts.has_cut_pass || step.action == Action::recover_pass);
      EXPECT_FALSE(is_recording && facts.has_pass && step.to == State::idle);
    }
  }
}

TEST(SessionState, AWholeScanFromOneButton) {
  SessionFacts facts{.has_host = true};
  State state = State::idle;
  std::vector<Action> actions;
  const auto happens = [&](Event event) {
    const SessionStep step = next_step(state, event, facts);
    state = step.to;
    if (step.action != Action::none) actions.push_back(step.action);
  };
  const auto press = [&] { happens(event_of(OperatorCommand::Kind::press, state)); };
  press();
  happens(Event::camera_settled);
  EXPECT_EQ(state, State::pass);
  happens(Event::camera_lost);
  EXPECT_EQ(state, State::pass);
  press();
  facts.has_pass = true;
  happens(Event::pass_closed);
  EXPECT_EQ(state, State::between_passes);
  press();
  happens(Event::settle_timeout);
  press();
  facts.has_next = false;
  happens(Event::pass_closed);
  happens(Event::scan_closed);
  EXPECT_EQ(state, State::waiting_for_host);
  happens(Event::all_acknowledged);
  happens(Event::avatar_received);
  EXPECT_EQ(state, State::avatar_ready);
  press();
  EXPECT_EQ(state, State::idle);
  EXPECT_EQ(actions, (std::vector<Action>{Action::arm, Action::record, Action::close_pass, Action::arm, Action::record,
                                          Action::close_pass, Action::close_scan, Action::forget}));
}

TEST(OperatorCommand, APressIsWhatIsNext) {
  const std::map<State, Event> expected = {{State::idle, Event::start},
                                           {State::arming, Event::stop},
                                           {State::pass, Event::stop},
                                           {State::between_passes, Event::start},
                                           {State::finishing, Event::start},
                                           {State::waiting_for_host, Event::start},
                                           {State::avatar_ready, Event::acknowledge},
                                           {State::fault, Event::acknowledge}};
  for (const auto& [state, event] : expected)
    EXPECT_EQ(event_of(OperatorCommand::Kind::press, state), event) << name_of(state);
  EXPECT_EQ(event_of(OperatorCommand::Kind::start, State::pass), Event::start);
  EXPECT_EQ(event_of(OperatorCommand::Kind::shut_down, State::pass), Event::shut_down);
}

}  // namespace
}  // namespace gyre
