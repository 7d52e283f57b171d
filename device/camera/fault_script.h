// SPDX-License-Identifier: Apache-2.0
// What goes wrong with a camera that a recording plays, and when: a JSON file
//
//   {"faults": [{"before_frame": 30, "kind": "late", "seconds": 0.4},
//               {"before_frame": 40, "kind": "missing", "frames": 3},
//               {"before_frame": 50, "kind": "torn"},
//               {"before_frame": 60, "kind": "silence", "until": "restart"},
//               {"before_frame": 70, "kind": "broken", "until": "reopen"},
//               {"before_frame": 80, "kind": "gone", "seconds": 5}]}
#pragma once

#include "common/result/result.h"

#include <filesystem>
#include <string_view>
#include <vector>

namespace gyre {

struct Fault {
  enum class Kind {
    late,     // the frame comes that much after its time
    missing,  // so many frames never come
    torn,     // so many frames come damaged
    silence,  // nothing comes
    broken,   // asking for a frame is an error
    gone,     // the device is not there, as after its plug was pulled
  };
  // What ends a silence, a broken stream or an absence. What waits for a reopening outlasts restarts of the stream.
  enum class Until { time, restart, reopen, never };

  Kind kind = Kind::missing;
  int before_frame = 0;  // of the recording
  int frames = 1;        // missing, torn
  double seconds = 0.0;  // late, and what lasts until a time
  Until until = Until::time;
  bool operator==(const Fault&) const = default;
};

// Faults in ascending order of their frames, one a frame. Errors (wrong use): no JSON, an entry that is none of the
// above, named by its number from 1.
Result<std::vector<Fault>> parse_fault_script(std::string_view text);
Result<std::vector<Fault>> read_fault_script(const std::filesystem::path& file);

}  // namespace gyre
