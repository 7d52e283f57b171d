// SPDX-License-Identifier: Apache-2.0
#include "offload/ingest/part_files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <cstring>

namespace gyre {

namespace {

// One for every device that sends, at the sizes Gyre is made for.
constexpr std::size_t most_open = 32;

// Bytes of a file that still has its name.
std::optional<std::uint64_t> size_of(int descriptor) {
  struct stat now {};
  if (::fstat(descriptor, &now) != 0 || now.st_nlink == 0) return std::nullopt;
  return static_cast<std::uint64_t>(now.st_size);
}

tl::unexpected<Error> cannot_store(const std::filesystem::path& file, int code) {
  return fail("cannot store a file", file.string() + " (" + std::strerror(code) + ")",
              code == ENOSPC || code == EDQUOT ? "free some disk space on the host" : "");
}

}  // namespace

PartFiles::~PartFiles() {
  for (const Open& one : open_) ::close(one.descriptor);
}

std::list<PartFiles::Open>::iterator PartFiles::find(const std::filesystem::path& file) {
  return std::find_if(open_.begin(), open_.end(), [&](const Open& one) { return one.file == file; });
}

std::optional<std::uint64_t> PartFiles::held(const std::filesystem::path& file) {
  const auto one = find(file);
  if (one == open_.end()) return std::nullopt;
  open_.splice(open_.begin(), open_, one);
  const std::optional<std::uint64_t> size = size_of(one->descriptor);
  if (!size) close(file);
  return size;
}

Result<std::uint64_t> PartFiles::open(const std::filesystem::path& file) {
  if (const std::optional<std::uint64_t> size = held(file)) return *size;
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644);
  if (descriptor < 0) return cannot_store(file, errno);
  open_.push_front({file, descriptor});
  if (open_.size() > most_open) {
    ::close(open_.back().descriptor);
    open_.pop_back();
  }
  return size_of(descriptor).value_or(0);
}

Result<void> PartFiles::write(const std::filesystem::path& file, std::uint64_t offset, std::string_view data) {
  const auto one = find(file);
  if (one == open_.end()) return cannot_store(file, EBADF);
  while (!data.empty()) {
    const ssize_t written = ::pwrite(one->descriptor, data.data(), data.size(), static_cast<off_t>(offset));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return cannot_store(file, written < 0 ? errno : ENOSPC);
    offset += static_cast<std::uint64_t>(written);
    data.remove_prefix(static_cast<std::size_t>(written));
  }
  return {};
}

void PartFiles::close(const std::filesystem::path& file) {
  const auto one = find(file);
  if (one == open_.end()) return;
  ::close(one->descriptor);
  open_.erase(one);
}

void PartFiles::hand_over(const std::filesystem::path& file) {
  const auto one = find(file);
  if (one == open_.end()) return;
  // A hint: whether the bytes are on the disk is for fsync to say.
  static_cast<void>(::sync_file_range(one->descriptor, 0, 0, SYNC_FILE_RANGE_WRITE));
  close(file);
}

void PartFiles::close_removed() {
  std::erase_if(open_, [](const Open& one) {
    if (size_of(one.descriptor)) return false;
    ::close(one.descriptor);
    return true;
  });
}

}  // namespace gyre
