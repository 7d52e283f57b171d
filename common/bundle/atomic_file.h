// SPDX-License-Identifier: Apache-2.0
// Files that are either there whole or not there: temporary name, sync, rename, sync of the folder.
#pragma once

#include "common/result/result.h"

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace gyre {

// Writes `bytes` to `file` so that a crash at any moment leaves the old content or the new one. On return the file and
// its name are on disk. A full disk is an error that says so; the temporary file is removed then.
Result<void> write_file(const std::filesystem::path& file, std::span<const std::byte> bytes);
Result<void> write_file(const std::filesystem::path& file, std::string_view text);

// Renames over whatever is there and syncs the folder of the new name. `from` must be on the same file system.
Result<void> rename_durably(const std::filesystem::path& from, const std::filesystem::path& to);

// Flushes a file, or the entries of a folder, to disk.
Result<void> sync_path(const std::filesystem::path& path);

// Removes what writes that were cut off have left in a folder; nobody may be writing there.
void remove_temporaries(const std::filesystem::path& folder);

Result<std::string> read_file(const std::filesystem::path& file);

}  // namespace gyre
