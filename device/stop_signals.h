// SPDX-License-Identifier: Apache-2.0
// SIGTERM and SIGINT as a call; SIGUSR1 and SIGUSR2 make the messages more and fewer.
#pragma once

#include <atomic>
#include <functional>
#include <thread>

namespace gyre {

// Made before any other thread. The first SIGTERM or SIGINT calls `stop`, from a thread of its own; a second one ends
// the program at once.
class StopSignals {
 public:
  explicit StopSignals(std::function<void()> stop);
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

 private:
  void wait();

  std::function<void()> stop_;
  std::atomic<bool> is_over_{false};
  std::thread thread_;
};

}  // namespace gyre
