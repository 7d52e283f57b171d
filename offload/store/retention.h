// SPDX-License-Identifier: Apache-2.0
// Deletes what the retention policy lets go, again and again while the host serves.
#pragma once

#include "offload/store/store.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>

namespace gyre {

// Works on a thread of its own between start() and stop(), at once and then at every interval. The store outlives it.
class Retention {
 public:
  Retention(RetentionPolicy policy, Store& store, std::chrono::milliseconds interval = std::chrono::minutes(10),
            std::function<WallTime()> now = wall_time_now)
      : policy_(policy), store_(store), interval_(interval), now_(std::move(now)) {}
  ~Retention() { stop(); }
  Retention(const Retention&) = delete;
  Retention& operator=(const Retention&) = delete;

  void start();
  void stop();
  std::uint64_t deleted() const { return deleted_; }  // scans so far

 private:
  void apply();

  RetentionPolicy policy_;
  Store& store_;
  std::chrono::milliseconds interval_;
  std::function<WallTime()> now_;
  std::atomic<std::uint64_t> deleted_{0};
  std::mutex mutex_;
  std::condition_variable changed_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace gyre
