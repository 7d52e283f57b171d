// SPDX-License-Identifier: Apache-2.0
// The time of day as everything that Gyre writes states it.
#pragma once

#include <string>

namespace gyre {

// Now, in UTC, to the second: "2026-01-31T08:15:00Z".
std::string utc_now();

}  // namespace gyre
