// SPDX-License-Identifier: Apache-2.0
// The rig's status for a terminal: one screen.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace gyre {

// status: as status_view() has it, null when the daemon does not run; scans: as scan_rows(). At most `most_scans` of
// them. Of JSON and not of structs, as it comes from another process.
std::string status_text(const nlohmann::json& status, const nlohmann::json& scans, std::size_t most_scans = 10);

}  // namespace gyre
