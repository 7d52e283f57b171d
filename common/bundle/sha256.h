// SPDX-License-Identifier: Apache-2.0
// SHA-256 of bytes, files and folders, as 64 lower-case hex digits.
#pragma once

#include "common/result/result.h"

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace gyre {

std::string sha256(std::span<const std::byte> bytes);
std::string sha256(std::string_view text);
Result<std::string> sha256_of_file(const std::filesystem::path& file);

// Hash of a folder's content: over the sorted relative names and the hashes of its files, recursively. Files named
// `except` do not count.
Result<std::string> sha256_of_folder(const std::filesystem::path& folder, std::string_view except = {});

}  // namespace gyre
