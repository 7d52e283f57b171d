// SPDX-License-Identifier: Apache-2.0
// ULID: the name of a scan, sortable by time (github.com/ulid/spec).
#pragma once

#include <string>
#include <string_view>

namespace gyre {

// 26 characters of Crockford's base 32: 48 bits of milliseconds since 1970, 80 bits from the system's random source.
std::string new_ulid();

// True for a well-formed ULID. Scan ids come from outside and become folder names: check before use.
bool is_ulid(std::string_view text);

}  // namespace gyre
