// SPDX-License-Identifier: Apache-2.0
// The files that are being received, held open from chunk to chunk: a file is opened once, not for every chunk of it.
#pragma once

#include "common/result/result.h"

#include <cstdint>
#include <filesystem>
#include <list>
#include <optional>
#include <string_view>

namespace gyre {

// Only the latest are held open, however many a device begins. What was removed from its folder meanwhile is not held
// any more, so that a chunk for it begins anew.
class PartFiles {
 public:
  PartFiles() = default;
  PartFiles(const PartFiles&) = delete;
  PartFiles& operator=(const PartFiles&) = delete;
  ~PartFiles();

  // Bytes there are of a file that is held open; nothing when it is not.
  std::optional<std::uint64_t> held(const std::filesystem::path& file);
  // Opens a file, creating it if need be, unless it is open. Returns the bytes there are.
  Result<std::uint64_t> open(const std::filesystem::path& file);
  // Writes all of data at `offset` of a file that is open.
  Result<void> write(const std::filesystem::path& file, std::uint64_t offset, std::string_view data);
  void close(const std::filesystem::path& file);
  // Closes a file that is whole; the disk begins with it at once, and has not far to go when it is to be synced.
  void hand_over(const std::filesystem::path& file);
  // Gives the room of files back that were removed.
  void close_removed();

 private:
  struct Open {
    std::filesystem::path file;
    int descriptor = -1;
  };
  std::list<Open>::iterator find(const std::filesystem::path& file);

  std::list<Open> open_;  // the latest first
};

}  // namespace gyre
