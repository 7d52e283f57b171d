// SPDX-License-Identifier: Apache-2.0
// Where the rig is on its way from a button press to an avatar: a table of states and events.
//
// Pure: the table says what is to be done and whoever runs the scan does it.
#pragma once

#include <span>
#include <string_view>

namespace gyre {

enum class SessionState {
  idle,              // waits for somebody to scan
  arming,            // the camera settles and is locked; the pass begins when it is
  pass,              // records
  between_passes,    // a pass is recorded, another one is to follow
  finishing,         // decides what a pass keeps, closes the scan
  waiting_for_host,  // the scan is closed; the host gets it and makes the avatar
  avatar_ready,      // it is here
  fault,             // nothing can be recorded until something is put right
};
inline constexpr int session_state_count = static_cast<int>(SessionState::fault) + 1;

enum class SessionEvent {
  // From the operator.
  start,        // a pass; of a scan that is new when none is open
  stop,         // the pass
  cancel,       // what is being recorded, or what is still to be
  acknowledge,  // has seen the avatar, or the fault
  shut_down,    // also when the service is stopped: nothing more is begun
  // From the camera.
  camera_settled,
  settle_timeout,   // it did not settle and was locked as it was
  camera_lost,      // no frames come; being brought back
  camera_given_up,  // and will not be
  recording_ended,  // of cameras that play one; a live one has given as much as a pass may have
  // From the disk.
  disk_low,
  storage_failed,  // a file could not be written
  trouble_over,    // the camera is back and the disk has room
  // From the work that a step began.
  pass_closed,
  pass_unusable,  // too short, or the camera did not move
  scan_closed,
  // From the host.
  all_acknowledged,  // it has the whole scan
  avatar_received,
  reconstruction_failed,
  // The program has started; the state is the one it ended in.
  restart,
};
inline constexpr int session_event_count = static_cast<int>(SessionEvent::restart) + 1;

// What a step depends on besides state and event.
struct SessionFacts {
  bool has_pass = false;      // the open scan has a pass that is recorded and closed
  bool has_cut_pass = false;  // and one that was cut off, part of it in the spool
  bool has_next = true;       // a pass is still to be recorded
  bool has_host = false;      // scans go to one
};

// What is to be done in a step.
enum class SessionAction {
  none,
  arm,           // open a scan when there is none, let the camera settle and lock it
  disarm,        // leave the pass that has not begun
  record,        // the pass begins with the next frame
  close_pass,    // decide on its keyframes
  recover_pass,  // of one that was cut off: keep what the spool has of it
  drop_pass,     // take back all of it
  close_scan,
  forget,  // the scan that was shown
};

struct SessionStep {
  SessionState to = SessionState::idle;
  SessionAction action = SessionAction::none;
};

// Which of the facts a row of the table asks for.
enum class SessionGuard {
  always,
  has_cut_pass,
  has_pass,  // and none that was cut off
  no_pass,   // neither
  has_next,
  no_next,
  has_host,
  no_host,
};

struct SessionTransition {
  SessionState from;
  SessionEvent event;
  SessionGuard guard;
  SessionStep step;
};

// The whole table; README.md shows it.
std::span<const SessionTransition> session_transitions();

bool holds(SessionGuard guard, const SessionFacts& facts);

// The step that the event leads to. An event that the table does not have in a state changes nothing.
SessionStep next_step(SessionState state, SessionEvent event, const SessionFacts& facts);

// "idle", "between_passes"; as names in files and for the page.
std::string_view name_of(SessionState state);
std::string_view name_of(SessionEvent event);

}  // namespace gyre
