// SPDX-License-Identifier: Apache-2.0
#include "device/stop_signals.h"

#include <unistd.h>
#include <csignal>
#include <ctime>
#include <utility>

namespace gyre {

namespace {

sigset_t stopping() {
  sigset_t signals;
  ::sigemptyset(&signals);
  ::sigaddset(&signals, SIGTERM);
  ::sigaddset(&signals, SIGINT);
  return signals;
}

}  // namespace

StopSignals::StopSignals(std::function<void()> stop) : stop_(std::move(stop)) {
  const sigset_t signals = stopping();
  ::pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  thread_ = std::thread(&StopSignals::wait, this);
}

StopSignals::~StopSignals() {
  is_over_ = true;
  thread_.join();
}

void StopSignals::wait() {
  constexpr timespec patience{0, 100'000'000};
  const sigset_t signals = stopping();
  bool is_first = true;
  while (!is_over_) {
    const int signal = ::sigtimedwait(&signals, nullptr, &patience);
    if (signal < 0) continue;
    constexpr int killed = 128;
    if (!is_first) ::_exit(killed + signal);
    is_first = false;
    stop_();
  }
}

}  // namespace gyre
