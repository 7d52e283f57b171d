// SPDX-License-Identifier: Apache-2.0
// How much room is left on a disk.
#pragma once

#include "common/result/result.h"

#include <cstdint>
#include <filesystem>

namespace gyre {

// Bytes that others than root may still write to the file system of `path`.
Result<std::uint64_t> free_bytes(const std::filesystem::path& path);

}  // namespace gyre
