// SPDX-License-Identifier: Apache-2.0
// Work that takes its time, beside the thread that brings it: what waits is done in order, batch by batch, and the
// outcomes are fetched when there are some.
#pragma once

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <iterator>
#include <limits>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace gyre {

struct BatchLimits {
  std::size_t waiting = std::numeric_limits<std::size_t>::max();  // before add() waits
  std::size_t at_once = std::numeric_limits<std::size_t>::max();  // in a batch
};

// add(), wait() and take() are for any thread.
template <class Task, class Outcome>
class BatchWorker {
 public:
  using Work = std::function<std::vector<Outcome>(std::vector<Task>)>;

  // work and on_done are called from the worker's thread, on_done when take() has something.
  BatchWorker(const BatchLimits& limits, Work work, std::function<void()> on_done)
      : limits_(limits), work_(std::move(work)), on_done_(std::move(on_done)), thread_([this] { run(); }) {}
  // What has not been begun is not done.
  ~BatchWorker() {
    {
      const std::scoped_lock lock(mutex_);
      stopping_ = true;
      changed_.notify_all();
    }
    thread_.join();
  }
  BatchWorker(const BatchWorker&) = delete;
  BatchWorker& operator=(const BatchWorker&) = delete;

  // Waits while too much is waiting, so that nobody brings work faster than it is done.
  void add(Task task) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return waiting_.size() < limits_.waiting; });
    waiting_.push_back(std::move(task));
    changed_.notify_all();
  }

  // Until all that was added is done.
  void wait() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return waiting_.empty() && !at_work_; });
  }

  std::vector<Outcome> take() {
    const std::scoped_lock lock(mutex_);
    return std::exchange(done_, {});
  }

 private:
  std::vector<Task> next_batch() {
    const auto end = waiting_.begin() + static_cast<std::ptrdiff_t>(std::min(limits_.at_once, waiting_.size()));
    std::vector<Task> batch(std::make_move_iterator(waiting_.begin()), std::make_move_iterator(end));
    waiting_.erase(waiting_.begin(), end);
    return batch;
  }

  void run() {
    std::unique_lock lock(mutex_);
    while (true) {
      changed_.wait(lock, [this] { return stopping_ || !waiting_.empty(); });
      if (stopping_) return;
      std::vector<Task> batch = next_batch();
      at_work_ = true;
      changed_.notify_all();
      lock.unlock();
      std::vector<Outcome> done = work_(std::move(batch));
      lock.lock();
      at_work_ = false;
      std::move(done.begin(), done.end(), std::back_inserter(done_));
      changed_.notify_all();
      lock.unlock();
      on_done_();
      lock.lock();
    }
  }

  BatchLimits limits_;
  Work work_;
  std::function<void()> on_done_;
  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::deque<Task> waiting_;
  std::vector<Outcome> done_;
  bool at_work_ = false;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace gyre
