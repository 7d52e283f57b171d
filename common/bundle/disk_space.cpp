// SPDX-License-Identifier: Apache-2.0
#include "common/bundle/disk_space.h"

#include <sys/statvfs.h>
#include <cerrno>
#include <cstring>

namespace gyre {

Result<std::uint64_t> free_bytes(const std::filesystem::path& path) {
  struct statvfs info {};
  if (::statvfs(path.c_str(), &info) != 0) {
    return fail("cannot look at the disk", path.string() + " (" + std::strerror(errno) + ")");
  }
  return static_cast<std::uint64_t>(info.f_bavail) * info.f_frsize;
}

}  // namespace gyre
