// SPDX-License-Identifier: Apache-2.0
// The secret that lets a browser on another machine in.
#pragma once

#include "common/result/result.h"

#include <filesystem>
#include <string>

namespace gyre {

// 160 bits of the system's random source as 40 hexadecimal digits.
std::string new_token();

// Reads the token in `file`, or makes one there (mode 0600). Errors: it cannot be read or written, others may read it,
// or it is none.
Result<std::string> read_or_make_token(const std::filesystem::path& file);

}  // namespace gyre
