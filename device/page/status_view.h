// SPDX-License-Identifier: Apache-2.0
// The rig's status as JSON, for the page and for `gyre-device status`; device/page/web/model.ts has the same shape.
#pragma once

#include "device/session/live_status.h"

#include <nlohmann/json.hpp>

namespace gyre {

// Of a band of the pass, but for a turn of which no place is known, {"band", "is_ring", "cells", "quality"}. A ring has
// to be seen all around; the texts have a letter a sector: '.' not seen, '~' seen and not sharp, '#' covered; and the
// best quality in tenths, '0' to '9'.
nlohmann::json status_view(const LiveStatus& status);

}  // namespace gyre
