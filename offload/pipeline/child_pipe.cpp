// SPDX-License-Identifier: Apache-2.0
#include "offload/pipeline/child_pipe.h"

#include <fcntl.h>
#include <unistd.h>
#include <cerrno>

namespace gyre {

ChildPipe::~ChildPipe() {
  close_end(0);
  close_end(1);
}

bool ChildPipe::open() {
  return ::pipe2(ends_.data(), O_CLOEXEC) == 0;
}

void ChildPipe::read_into(std::string& text) {
  std::array<char, 4096> block{};
  const ssize_t got = ::read(ends_[0], block.data(), block.size());
  if (got < 0 && errno == EINTR) return;
  if (got > 0) text.append(block.data(), static_cast<std::size_t>(got));
  if (got <= 0) close_end(0);
}

void ChildPipe::close_end(std::size_t which) {
  if (ends_[which] >= 0) ::close(ends_[which]);
  ends_[which] = -1;
}

}  // namespace gyre
