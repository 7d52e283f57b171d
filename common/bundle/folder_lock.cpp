// SPDX-License-Identifier: Apache-2.0
#include "common/bundle/folder_lock.h"

#include <fcntl.h>
#include <unistd.h>
#include <cerrno>
#include <cstring>
#include <utility>

namespace gyre {

Result<FolderLock> FolderLock::take(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "lock";
  FolderLock lock(::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644));
  // A record lock, not flock: a child that outlives us would keep an flock.
  struct flock whole {};
  whole.l_type = F_WRLCK;
  whole.l_whence = SEEK_SET;
  if (lock.fd_ >= 0 && ::fcntl(lock.fd_, F_SETLK, &whole) == 0) return lock;
  if (lock.fd_ >= 0 && (errno == EACCES || errno == EAGAIN)) {
    return fail("in use by another process", folder.string(), "stop that one first");
  }
  return fail("cannot lock", folder.string() + " (" + std::strerror(errno) + ")");
}

FolderLock::FolderLock(FolderLock&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}

FolderLock& FolderLock::operator=(FolderLock&& other) noexcept {
  std::swap(fd_, other.fd_);
  return *this;
}

FolderLock::~FolderLock() {
  if (fd_ >= 0) ::close(fd_);
}

}  // namespace gyre
