// SPDX-License-Identifier: Apache-2.0
// Loaded before a program's libraries (LD_PRELOAD), so that a disk can be full and a clock wrong for it alone, without
// rights and without a kernel that allows it.
#include "tests/system/fault_control.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <sys/time.h>
#include <sys/uio.h>
#include <unistd.h>
#include <cerrno>
#include <cstdlib>
#include <ctime>

namespace {

const gyre::FaultControl* map_control() {
  const char* file = std::getenv(gyre::fault_control_variable);
  const int fd = file == nullptr ? -1 : ::open(file, O_RDONLY | O_CLOEXEC);
  if (fd < 0) return nullptr;
  void* mapped = ::mmap(nullptr, sizeof(gyre::FaultControl), PROT_READ, MAP_SHARED, fd, 0);
  ::close(fd);
  return mapped == MAP_FAILED ? nullptr : static_cast<const gyre::FaultControl*>(mapped);
}

const gyre::FaultControl* control() {
  static const gyre::FaultControl* const mapped = map_control();
  return mapped;
}

template <class Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(::dlsym(RTLD_NEXT, name));
}

bool is_full() {
  return control() != nullptr && control()->disk_full.load() != 0;
}

// Sockets, pipes and events of a process go on.
bool is_file(int fd) {
  struct stat status {};
  return ::fstat(fd, &status) == 0 && S_ISREG(status.st_mode) && fd > STDERR_FILENO;
}

// What a full disk does: it takes half of one write now and then, and nothing more of the others.
bool takes_half() {
  static std::atomic<unsigned> count{0};
  return count++ % 4 == 0;
}

std::int64_t clock_offset_s() {
  return control() == nullptr ? 0 : control()->clock_offset_s.load();
}

int no_space() {
  errno = ENOSPC;
  return -1;
}

}  // namespace

extern "C" {

ssize_t write(int fd, const void* data, size_t size) {
  static const auto real = next<ssize_t (*)(int, const void*, size_t)>("write");
  if (!is_full() || !is_file(fd)) return real(fd, data, size);
  return size > 1 && takes_half() ? real(fd, data, size / 2) : no_space();
}

ssize_t writev(int fd, const iovec* parts, int count) {
  static const auto real = next<ssize_t (*)(int, const iovec*, int)>("writev");
  return is_full() && is_file(fd) ? no_space() : real(fd, parts, count);
}

ssize_t pwrite(int fd, const void* data, size_t size, off_t offset) {
  static const auto real = next<ssize_t (*)(int, const void*, size_t, off_t)>("pwrite");
  if (!is_full() || !is_file(fd)) return real(fd, data, size, offset);
  return size > 1 && takes_half() ? real(fd, data, size / 2, offset) : no_space();
}

ssize_t pwrite64(int fd, const void* data, size_t size, off64_t offset) {
  return pwrite(fd, data, size, offset);
}

int mkdir(const char* path, mode_t mode) {
  static const auto real = next<int (*)(const char*, mode_t)>("mkdir");
  return is_full() ? no_space() : real(path, mode);
}

int statvfs(const char* path, struct statvfs* out) {
  static const auto real = next<int (*)(const char*, struct statvfs*)>("statvfs");
  const int code = real(path, out);
  if (code == 0 && is_full()) out->f_bfree = out->f_bavail = 0;
  return code;
}

int clock_gettime(clockid_t clock, timespec* time) {
  static const auto real = next<int (*)(clockid_t, timespec*)>("clock_gettime");
  const int code = real(clock, time);
  if (code == 0 && clock == CLOCK_REALTIME) time->tv_sec += clock_offset_s();
  return code;
}

int gettimeofday(timeval* time, void*) {
  timespec now{};
  const int code = clock_gettime(CLOCK_REALTIME, &now);
  if (code == 0) *time = {now.tv_sec, now.tv_nsec / 1000};
  return code;
}

time_t time(time_t* out) {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  if (out != nullptr) *out = now.tv_sec;
  return now.tv_sec;
}

}  // extern "C"
