// SPDX-License-Identifier: Apache-2.0
// The flags that say how button, lights and buzzer are wired: those of the verb `panel`, which `run` obeys too.
#pragma once

#include "device/panel/panel.h"

namespace CLI {
class App;
}

namespace gyre {

void add_panel_flags(CLI::App& verb, PanelOptions& options);

}  // namespace gyre
