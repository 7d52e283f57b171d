// SPDX-License-Identifier: Apache-2.0
// The verbs of gyre-device: each adds its subcommand and sets `run` when the command line asks for it.
#pragma once

#include "common/result/result.h"

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

namespace CLI {
class App;
}

namespace gyre {

struct PanelOptions;

// What the chosen verb does; returns the exit code.
using Verb = std::function<int()>;

void add_replay_verb(CLI::App& app, Verb& run);
// panel: how it is wired, as the flags of the verb `panel` say; `run` obeys them too.
void add_run_verb(CLI::App& app, Verb& run, const std::shared_ptr<PanelOptions>& panel);
void add_panel_verb(CLI::App& app, Verb& run, const std::shared_ptr<PanelOptions>& panel);
void add_status_verb(CLI::App& app, Verb& run);
void add_pair_verb(CLI::App& app, Verb& run);
void add_calibrate_verb(CLI::App& app, Verb& run);

// Prints the error as one line on stderr and returns its exit code.
int report_error(const Error& error);

// Where the device keeps its own files when nothing is said: $XDG_DATA_HOME/gyre, or ~/.local/share/gyre.
std::filesystem::path data_folder();

// Files in the folder of keys: the device's pair, and the public key of the host it talks to.
std::filesystem::path device_key(const std::filesystem::path& keys);
std::filesystem::path host_key(const std::filesystem::path& keys);

// Folder of the calibrations of its cameras, see device/calibration/calibration_file.h.
std::filesystem::path cameras_folder();

// The file with the token of the rig's page.
std::filesystem::path page_token(const std::filesystem::path& spool);

// What this device calls itself when nothing is said: the host name, made fit for a file name.
std::string default_device_name();

}  // namespace gyre
