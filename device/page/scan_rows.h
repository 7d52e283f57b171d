// SPDX-License-Identifier: Apache-2.0
// The scans of the spool as JSON, for the page and for `gyre-device status`; device/page/web/model.ts has the same
// shape.
#pragma once

#include "device/session/live_status.h"
#include "device/spool/spool.h"

#include <nlohmann/json.hpp>

namespace gyre {

// {"id", "phase", "reason", "keyframes", "files", "acknowledged", "cover", "results", "stage", "fraction"}. The last
// two say what the host does with the scan, when it is the one that `now` waits for.
nlohmann::json scan_row(const SpooledScan& scan, const LiveStatus& now);

// All scans, the newest first.
nlohmann::json scan_rows(const Spool& spool, const LiveStatus& now);

}  // namespace gyre
