// SPDX-License-Identifier: Apache-2.0
// Wakes a thread that waits in zmq::poll.
#pragma once

namespace gyre {

class Wakeup {
 public:
  Wakeup();
  ~Wakeup();
  Wakeup(const Wakeup&) = delete;
  Wakeup& operator=(const Wakeup&) = delete;

  int descriptor() const { return fd_; }  // readable after notify(), until clear()
  void notify();                          // from any thread
  void clear();

 private:
  int fd_;
};

}  // namespace gyre
