// SPDX-License-Identifier: Apache-2.0
#include "device/session/work_queue.h"

#include <utility>

namespace gyre {

WorkQueue::WorkQueue(std::size_t places) : places_(places), thread_(&WorkQueue::serve, this) {}

WorkQueue::~WorkQueue() {
  {
    const std::lock_guard lock(mutex_);
    is_closed_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void WorkQueue::put(Work work) {
  {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return waiting_.size() < places_; });
    waiting_.push_back(std::move(work));
  }
  changed_.notify_all();
}

std::optional<Error> WorkQueue::error() const {
  const std::lock_guard lock(mutex_);
  return error_;
}

Result<void> WorkQueue::drain() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return waiting_.empty() && !is_busy_; });
  const std::optional<Error> error = std::exchange(error_, std::nullopt);
  if (error) return tl::unexpected(*error);
  return {};
}

void WorkQueue::serve() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [&] { return is_closed_ || !waiting_.empty(); });
    if (waiting_.empty()) return;
    {
      const Work work = std::move(waiting_.front());
      waiting_.pop_front();
      is_busy_ = true;
      lock.unlock();
      const Result<void> done = work();
      lock.lock();
      if (!done && !error_) error_ = done.error();
    }
    is_busy_ = false;
    changed_.notify_all();
  }
}

}  // namespace gyre
