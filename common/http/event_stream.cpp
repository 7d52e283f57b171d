// SPDX-License-Identifier: Apache-2.0
#include "common/http/event_stream.h"

#include <chrono>

namespace gyre {

namespace {

constexpr std::size_t most_waiting = 256;
constexpr std::chrono::milliseconds longest_silence{1000};

}  // namespace

class EventStream::Source : public HttpSource {
 public:
  explicit Source(std::shared_ptr<Watcher> watcher) : watcher_(std::move(watcher)) {}

  bool next(std::string& out) override {
    std::unique_lock lock(watcher_->mutex);
    watcher_->changed.wait_for(lock, longest_silence,
                               [this] { return !watcher_->waiting.empty() || watcher_->let_go; });
    if (watcher_->let_go) return false;
    if (watcher_->waiting.empty()) out += ": still here\n\n";  // a peer that has gone is noticed by writing to it
    for (const std::string& event : watcher_->waiting) out += event;
    watcher_->waiting.clear();
    return true;
  }

 private:
  std::shared_ptr<Watcher> watcher_;
};

void EventStream::publish(std::string_view event, std::string_view data) {
  const std::string text = format_event(event, data);
  const std::scoped_lock lock(mutex_);
  std::erase_if(watchers_, [](const std::weak_ptr<Watcher>& watcher) { return watcher.expired(); });
  for (const std::weak_ptr<Watcher>& reference : watchers_) {
    const std::shared_ptr<Watcher> watcher = reference.lock();
    if (!watcher) continue;
    const std::scoped_lock of_watcher(watcher->mutex);
    if (watcher->waiting.size() >= most_waiting) watcher->let_go = true;
    watcher->waiting.push_back(text);
    watcher->changed.notify_one();
  }
}

std::unique_ptr<HttpSource> EventStream::watch(const std::function<std::string()>& greeting) {
  const auto watcher = std::make_shared<Watcher>();
  {
    const std::scoped_lock lock(mutex_);
    watchers_.push_back(watcher);
  }
  // Registered before it is greeted, so that nothing falls between the two; its news may repeat the greeting.
  std::string first = greeting();
  {
    const std::scoped_lock lock(watcher->mutex);
    watcher->waiting.push_front(std::move(first));
  }
  return std::make_unique<Source>(watcher);
}

std::string format_event(std::string_view event, std::string_view data) {
  std::string text = "event: ";
  text.append(event).append("\ndata: ").append(data).append("\n\n");
  return text;
}

}  // namespace gyre
