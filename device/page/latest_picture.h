// SPDX-License-Identifier: Apache-2.0
// The picture of the camera as it is now, for whoever asks next: one picture and never a queue, so that a slow line
// makes it come less often and not later.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

namespace gyre {

// All methods may be called from any thread.
class LatestPicture {
 public:
  static constexpr int longer_side = 640;  // of what is sent, at most, pixels
  static constexpr int quality = 70;

  struct Sent {
    std::uint64_t number = 0;  // from 1
    std::string jpeg;
  };

  // Takes the place of the one before; costs nothing but that. The very same once more is no new one: a camera that is
  // silent shows nothing. image: 8-bit BGR, that nobody writes to any more.
  void set(const cv::Mat& image);

  // A picture with another number than `seen` (0: none was seen): the one that is there unless it is older than half a
  // second, else the next; nothing after `timeout` or close(). It is reduced and compressed here, on the thread of who
  // wants it.
  std::optional<Sent> wait(std::uint64_t seen, std::chrono::milliseconds timeout);

  // How many wait for a picture that is not there yet.
  int waiting() const;

  // Nobody waits any more, now and later.
  void close();

 private:
  using Clock = std::chrono::steady_clock;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  cv::Mat image_;
  std::uint64_t number_ = 0;
  Clock::time_point set_at_;
  int waiting_ = 0;
  bool closed_ = false;
};

}  // namespace gyre
