// SPDX-License-Identifier: Apache-2.0
// What the rig shows at a moment: on its lights, on its page and in `gyre-device status`.
#pragma once

#include "device/coverage/coverage_map.h"
#include "device/guidance/guidance.h"
#include "device/session/session_state.h"

#include <array>
#include <optional>
#include <string>

namespace gyre {

// One sector of one band of the pass that is on.
struct CellStatus {
  bool is_seen = false;
  bool is_covered = false;  // sharply
  double quality = 0.0;     // best, 0 to 1
  bool operator==(const CellStatus&) const = default;
};

// How far the host is with the scan that is waited for.
struct HostStatus {
  bool is_wanted = false;     // scans go to a host
  bool is_connected = false;  // it answers
  std::string text;           // one line about the connection
  std::string stage;          // "upload", "queued", or a stage of the pipeline; empty: none is waited for
  double fraction = 0.0;      // of the stage
  bool operator==(const HostStatus&) const = default;
};

struct LiveStatus {
  SessionState state = SessionState::idle;
  std::string scan;    // id; empty while none is open, waited for or shown
  std::string pass;    // "body", "head" or "turn": that is on, or that the next start begins
  std::string fault;   // in state fault: what is wrong and what to do
  std::string notice;  // what happened last that the operator should know; may be empty
  Signal signal;
  Conditions conditions;
  // Of the pass that is on, or was last.
  std::optional<double> azimuth;  // radians, counter-clockwise seen from above, from where the pass began
  Band band = Band::body_upper;
  std::array<std::array<CellStatus, CoverageMap::sectors>, all_bands.size()> cells{};  // by band and sector
  int frames = 0;
  // Of the scan.
  int keyframes = 0;               // spooled
  int acknowledged = 0;            // of them, by the host
  double frames_per_second = 0.0;  // that are analysed, over the last second
  double disk_free_mib = 0.0;
  HostStatus host;

  bool is_raised(Condition condition) const { return conditions[static_cast<std::size_t>(condition)]; }
};

}  // namespace gyre
