// SPDX-License-Identifier: Apache-2.0
// The picture of the camera as it is now, for whoever asks next: one picture and never a queue, so that a slow line
// makes it come less often and not later.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

namespace gyre {

// All methods may be called from any thread.
class LatestPicture {
 public:
  struct Numbered {
    std::uint64_t number = 0;  // from 1
    std::shared_ptr<const std::string> jpeg;
  };

  // Takes the place of the one before.
  void set(std::string jpeg);

  // Waits for a picture with another number than `seen` (0: none was seen) that is not older than half a second;
  // nothing after `timeout` or close().
  std::optional<Numbered> wait(std::uint64_t seen, std::chrono::milliseconds timeout);

  // Somebody waits for a picture that is not there yet: the time to make one.
  bool is_wanted() const;

  // Nobody waits any more, now and later.
  void close();

 private:
  using Clock = std::chrono::steady_clock;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  Numbered latest_;
  Clock::time_point set_at_;
  int waiting_ = 0;
  bool closed_ = false;
};

}  // namespace gyre
