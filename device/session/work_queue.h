// SPDX-License-Identifier: Apache-2.0
// Work that may take its time, one piece after the other on a thread of its own: writing to a slow card.
#pragma once

#include "common/result/result.h"

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

namespace gyre {

class WorkQueue {
 public:
  using Work = std::function<Result<void>()>;

  // places: pieces of work that may wait; whoever brings more waits too.
  explicit WorkQueue(std::size_t places);
  WorkQueue(const WorkQueue&) = delete;
  WorkQueue& operator=(const WorkQueue&) = delete;
  // What waits is still done.
  ~WorkQueue();

  void put(Work work);

  // The first error since the last drain().
  std::optional<Error> error() const;

  // Waits until everything is done, returns the first error and forgets it.
  Result<void> drain();

 private:
  void serve();

  std::size_t places_;
  mutable std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::deque<Work> waiting_;
  bool is_busy_ = false;
  bool is_closed_ = false;
  std::optional<Error> error_;
  std::thread thread_;
};

}  // namespace gyre
