// SPDX-License-Identifier: Apache-2.0
#include "device/camera/encode_pool.h"

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <list>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace gyre {

// What pool, threads and pictures share; outlives the pool as long as there are pictures.
struct EncodePool::State {
  enum class Phase { raw, asked, busy, done };
  struct Entry {
    RawPicture raw;
    Phase phase = Phase::raw;
    Result<std::string> jpeg;
  };

  explicit State(const EncodeOptions& given) : options(given) {}

  // All below with the mutex held.
  void ask(const std::shared_ptr<Entry>& entry, bool urgent) {
    if (entry->phase != Phase::raw) return;
    entry->phase = Phase::asked;
    if (urgent) {
      queue.push_front(entry);
    } else {
      queue.push_back(entry);
    }
    work.notify_one();
  }

  void compress(const std::shared_ptr<Entry>& entry, std::unique_lock<std::mutex>& lock) {
    entry->phase = Phase::busy;
    RawPicture raw = std::move(entry->raw);
    lock.unlock();
    Result<std::string> jpeg = encode_jpeg(raw, options.quality);
    lock.lock();
    entry->jpeg = std::move(jpeg);
    entry->phase = Phase::done;
    bytes -= raw.bytes.size();
    ++compressed;
    alive.remove(entry);
    done.notify_all();
  }

  void serve() {
    std::unique_lock<std::mutex> lock(mutex);
    for (;;) {
      work.wait(lock, [&] { return closed || !queue.empty(); });
      if (closed) return;
      const std::shared_ptr<Entry> entry = std::move(queue.front());
      queue.pop_front();
      if (entry->phase == Phase::asked) compress(entry, lock);
    }
  }

  EncodeOptions options;
  mutable std::mutex mutex;
  std::condition_variable work;
  std::condition_variable done;
  std::list<std::shared_ptr<Entry>> alive;  // raw, the oldest first
  std::deque<std::shared_ptr<Entry>> queue;
  std::size_t bytes = 0;
  int compressed = 0;
  bool closed = false;
  std::vector<std::thread> threads;
};

class EncodePool::Picture : public FullPicture {
 public:
  Picture(std::shared_ptr<State> state, std::shared_ptr<State::Entry> entry)
      : state_(std::move(state)), entry_(std::move(entry)) {}

  ~Picture() override {
    const std::scoped_lock lock(state_->mutex);
    if (entry_->phase != State::Phase::raw && entry_->phase != State::Phase::asked) return;
    entry_->phase = State::Phase::done;
    state_->bytes -= entry_->raw.bytes.size();
    state_->alive.remove(entry_);
    std::erase(state_->queue, entry_);
  }

  Result<std::string> jpeg() const override {
    std::unique_lock<std::mutex> lock(state_->mutex);
    state_->ask(entry_, true);
    if (state_->closed && entry_->phase == State::Phase::asked) state_->compress(entry_, lock);
    state_->done.wait(lock, [&] { return entry_->phase == State::Phase::done; });
    return entry_->jpeg;
  }

 private:
  std::shared_ptr<State> state_;
  std::shared_ptr<State::Entry> entry_;
};

EncodePool::EncodePool(const EncodeOptions& options) : state_(std::make_shared<State>(options)) {
  for (int i = 0; i < options.threads; ++i) {
    state_->threads.emplace_back([state = state_.get()] { state->serve(); });
  }
}

EncodePool::~EncodePool() {
  {
    const std::scoped_lock lock(state_->mutex);
    state_->closed = true;
    state_->queue.clear();
  }
  state_->work.notify_all();
  for (std::thread& thread : state_->threads) thread.join();
}

std::shared_ptr<const FullPicture> EncodePool::keep(RawPicture picture) {
  const std::size_t size = picture.bytes.size();
  const std::scoped_lock lock(state_->mutex);
  const std::size_t pressure = state_->options.most_bytes / 4 * 3;
  std::size_t remaining = state_->bytes + size;
  for (const auto& entry : state_->alive) {
    if (remaining <= pressure) break;
    remaining -= entry->raw.bytes.size();
    state_->ask(entry, false);
  }
  if (state_->bytes + size > state_->options.most_bytes) return nullptr;
  auto entry = std::make_shared<State::Entry>();
  entry->raw = std::move(picture);
  state_->bytes += size;
  state_->alive.push_back(entry);
  return std::make_shared<Picture>(state_, std::move(entry));
}

std::size_t EncodePool::bytes() const {
  const std::scoped_lock lock(state_->mutex);
  return state_->bytes;
}

int EncodePool::compressed() const {
  const std::scoped_lock lock(state_->mutex);
  return state_->compressed;
}

}  // namespace gyre
