// SPDX-License-Identifier: Apache-2.0
// Remembers which scan a command was working on, so that the same command after a crash goes on with the same scan.
#pragma once

#include "common/result/result.h"

#include <filesystem>
#include <string>

namespace gyre {

struct UnfinishedScan {
  std::string id;       // ULID
  std::string created;  // ISO 8601, UTC
  bool resumed = false;
};

// The scan that `request` (any text that is the same for the same command) has not finished yet, or a new one. Kept in
// <spool>/unfinished/; on disk when this returns. A damaged entry counts as none.
Result<UnfinishedScan> begin_scan(const std::filesystem::path& spool, const std::string& request);

// The command has finished: the next one like it starts a new scan.
void end_scan(const std::filesystem::path& spool, const std::string& request);

}  // namespace gyre
