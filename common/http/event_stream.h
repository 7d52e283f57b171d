// SPDX-License-Identifier: Apache-2.0
// Server-sent events: what happens, told to every page that is open.
// https://html.spec.whatwg.org/multipage/server-sent-events.html
#pragma once

#include "common/http/http_server.h"

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace gyre {

// All methods may be called from any thread. Must outlive the server its sources go to.
class EventStream {
 public:
  static constexpr const char* type = "text/event-stream";

  // Tells everybody who watches. data: without line breaks. A watcher that does not read fast enough is let go; the
  // browser comes back by itself and starts over.
  void publish(std::string_view event, std::string_view data);

  // What one more watcher reads: first what `greeting` adds to it (by format_event), then everything published since.
  std::unique_ptr<HttpSource> watch(const std::function<std::string()>& greeting);

 private:
  struct Watcher {
    std::mutex mutex;
    std::condition_variable changed;
    std::deque<std::string> waiting;
    bool let_go = false;
  };
  class Source;

  std::mutex mutex_;
  std::vector<std::weak_ptr<Watcher>> watchers_;
};

// One event as it goes over the line.
std::string format_event(std::string_view event, std::string_view data);

}  // namespace gyre
