// SPDX-License-Identifier: Apache-2.0
#include "common/wire/wakeup.h"

#include <sys/eventfd.h>
#include <unistd.h>
#include <cstdint>
#include <cstdlib>

namespace gyre {

Wakeup::Wakeup() : fd_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (fd_ < 0) std::abort();  // out of descriptors at start: nothing works then
}

Wakeup::~Wakeup() {
  ::close(fd_);
}

void Wakeup::notify() {
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = ::write(fd_, &one, sizeof one);  // fails only when already notified
}

void Wakeup::clear() {
  std::uint64_t count = 0;
  [[maybe_unused]] const ssize_t got = ::read(fd_, &count, sizeof count);  // fails only when not notified
}

}  // namespace gyre
