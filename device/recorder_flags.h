// SPDX-License-Identifier: Apache-2.0
// The flags that say how passes are recorded.
#pragma once

#include "device/session/pass_recorder.h"

namespace CLI {
class App;
}

namespace gyre {

struct RecorderFlags {
  FlowMethod flow = FlowMethod::farneback;
  int memory_mib = 32;
};

// A recording gives its pictures again, so only a live camera's are kept in memory.
void add_flow_flag(CLI::App& verb, RecorderFlags& flags);
void add_live_recorder_flags(CLI::App& verb, RecorderFlags& flags);

RecorderOptions recorder_options(const RecorderFlags& given);

}  // namespace gyre
