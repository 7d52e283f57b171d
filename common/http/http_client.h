// SPDX-License-Identifier: Apache-2.0
// Asks a program of ours on this machine.
#pragma once

#include "common/result/result.h"

#include <chrono>
#include <optional>
#include <string>

namespace gyre {

// The body of what http://address:port/path answers; nothing when nobody answers there. token: shown when not empty.
// Errors: it answers something else than 200.
Result<std::optional<std::string>> http_get(const std::string& address, int port, const std::string& path,
                                            const std::string& token, std::chrono::milliseconds patience);

}  // namespace gyre
