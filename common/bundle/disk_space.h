// SPDX-License-Identifier: Apache-2.0
// How much room is left on a disk.
#pragma once

#include "common/result/result.h"

#include <cstdint>
#include <filesystem>
#include <string_view>

namespace gyre {

// Bytes that others than root may still write to the file system of `path`.
Result<std::uint64_t> free_bytes(const std::filesystem::path& path);

// What is to be done begins like that in every error of a write that found no room.
inline constexpr std::string_view full_disk_remedy = "free some disk space";

// By then there may be room again.
inline bool is_full_disk(const Error& error) {
  return error.remedy.starts_with(full_disk_remedy);
}

}  // namespace gyre
