// SPDX-License-Identifier: Apache-2.0
#include "device/stop_signals.h"

#include "common/log/log_format.h"

#include <unistd.h>
#include <csignal>
#include <ctime>
#include <utility>

namespace gyre {

namespace {

sigset_t awaited() {
  sigset_t signals;
  ::sigemptyset(&signals);
  for (const int signal : {SIGTERM, SIGINT, SIGUSR1, SIGUSR2}) ::sigaddset(&signals, signal);
  return signals;
}

}  // namespace

StopSignals::StopSignals(std::function<void()> stop) : stop_(std::move(stop)) {
  const sigset_t signals = awaited();
  ::pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  thread_ = std::thread(&StopSignals::wait, this);
}

StopSignals::~StopSignals() {
  is_over_ = true;
  thread_.join();
}

void StopSignals::wait() {
  constexpr timespec patience{0, 100'000'000};
  const sigset_t signals = awaited();
  bool is_first = true;
  while (!is_over_) {
    const int signal = ::sigtimedwait(&signals, nullptr, &patience);
    if (signal < 0) continue;
    if (signal == SIGUSR1 || signal == SIGUSR2) {
      change_log_level(signal == SIGUSR1 ? 1 : -1);
      continue;
    }
    constexpr int killed = 128;
    if (!is_first) ::_exit(killed + signal);
    is_first = false;
    stop_();
  }
}

}  // namespace gyre
