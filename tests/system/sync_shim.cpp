// SPDX-License-Identifier: Apache-2.0
// Loaded before a program's libraries (LD_PRELOAD): keeps account of what it has synced, see platter.h, and can end it
// just before or just after a sync, where a power cut is most likely to find something half done.
//
//   GYRE_PLATTER       where the account is kept
//   GYRE_PLATTER_ROOT  the folder that it is about
//   GYRE_CUT_AT_SYNC   N or -N: kills the program after its Nth sync, or in its place
#include "tests/system/platter.h"

#include <unistd.h>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <mutex>

namespace {

class Account {
 public:
  Account(const char* folder, const char* root) : platter_(folder, root) {
    if (const char* const at = std::getenv("GYRE_CUT_AT_SYNC")) {
      left_ = std::abs(std::atol(at));
      before_ = std::atol(at) < 0;
    }
  }

  // One after the other, so that an older listing of a folder never replaces a newer one.
  int sync(int fd) {
    const std::lock_guard lock(mutex_);
    const bool last = left_ > 0 && --left_ == 0;
    if (last && before_) ::kill(::getpid(), SIGKILL);
    const bool done = platter_.sync(fd);
    if (last) ::kill(::getpid(), SIGKILL);
    if (!done) errno = EIO;
    return done ? 0 : -1;
  }

 private:
  std::mutex mutex_;
  gyre::Platter platter_;
  long left_ = 0;
  bool before_ = false;
};

// Null: none is asked for. Never destroyed, as threads may sync until the very end.
Account* account() {
  static Account* const it = [] {
    const char* const folder = std::getenv("GYRE_PLATTER");
    const char* const root = std::getenv("GYRE_PLATTER_ROOT");
    return folder != nullptr && root != nullptr ? new Account(folder, root) : nullptr;
  }();
  return it;
}

}  // namespace

// The real disk is not troubled: nobody is going to cut its power.
extern "C" int fsync(int fd) {
  return account() == nullptr ? 0 : account()->sync(fd);
}

extern "C" int fdatasync(int fd) {
  return fsync(fd);
}
