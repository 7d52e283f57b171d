// SPDX-License-Identifier: Apache-2.0
// Keeps a folder to one process: a lock that goes when the process does, however it ends.
#pragma once

#include "common/result/result.h"

#include <filesystem>

namespace gyre {

class FolderLock {
 public:
  // Locks <folder>/lock; an error when another process holds it. Not inherited by child processes.
  static Result<FolderLock> take(const std::filesystem::path& folder);
  FolderLock(FolderLock&& other) noexcept;
  FolderLock& operator=(FolderLock&& other) noexcept;
  ~FolderLock();

 private:
  explicit FolderLock(int fd) : fd_(fd) {}
  int fd_;
};

}  // namespace gyre
